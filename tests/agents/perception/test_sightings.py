"""How near the centre of a robot is to where the returns from its side suggest it.

The robots are boxes of the size of an ATRV-Jr, seen by a laser of 181 beams, from all sides and many distances.
"""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.agents.perception.scenes import RADIUS, box, covariance_of, look
from vrg.agents.perception.clusters import BODY_ERROR, HALF_WIDTH, HEADING_ERROR, clusters, sighting_of
from vrg.agents.perception.scan import Floats, Scan, make_scan
from vrg.bus.codec import checked
from vrg.bus.messages import Sighting, Sightings
from vrg.types import Pose, Uncertainty, Vector

NEAREST, FARTHEST = 1.5, 7.0


def seen_at(centre: Vector, turn: float, heading: float, rng: np.random.Generator, *, error: float) -> Sighting | None:
    """The sighting of a box by a laser at the origin; None if it is too far away to be seen by two beams."""
    believed = Pose(0.0, 0.0, heading + error * rng.standard_normal())
    scan = look(box(*centre, turn), Pose(0.0, 0.0, heading), believed=believed, noise=0.005 * rng.standard_normal(181))
    groups = clusters(scan, scan.hits)
    return sighting_of(scan, groups[0], radius=RADIUS, time=1.0) if len(groups) == 1 else None


@cache
def sample(error: float, count: int = 1500) -> tuple[Floats, Floats, Floats]:
    """The errors along the line of sight and across it, m, the squared normalised errors, and how far away it was."""
    rng = np.random.default_rng(5)
    errors, normalised, distances = [], [], []
    for _ in range(count):
        away, bearing = rng.uniform(NEAREST, FARTHEST), rng.uniform(-math.pi, math.pi)
        centre = away * math.cos(bearing), away * math.sin(bearing)
        heading = bearing + rng.uniform(-1.2, 1.2)
        sighting = seen_at(centre, rng.uniform(-math.pi, math.pi), heading, rng, error=error)
        assert sighting is not None
        dx, dy = sighting.x - centre[0], sighting.y - centre[1]
        c, s = math.cos(bearing), math.sin(bearing)
        errors.append((dx * c + dy * s, dy * c - dx * s))
        covariance = covariance_of(sighting)
        normalised.append(float(np.array([dx, dy]) @ np.linalg.solve(covariance, [dx, dy])))
        distances.append(away)
    return np.array(errors), np.array(normalised), np.array(distances)


def test_the_centre_is_found_to_a_quarter_of_a_metre_and_its_bias_does_not_grow_with_the_distance() -> None:
    errors, _, distances = sample(0.0)
    assert np.hypot(*errors.T).max() < 0.25
    along, aside = errors.mean(axis=0)
    assert abs(along) < 0.05
    assert abs(aside) < 0.01
    for low in (1.5, 3.0, 4.5, 6.0):
        here = (distances >= low) & (distances < low + 1.5)
        assert abs(errors[here, 0].mean()) < 0.06, f"{low} m"
        assert abs(errors[here, 1].mean()) < 0.02, f"{low} m"


def test_the_covariance_is_honest() -> None:
    """The squared normalised error has a mean of 2 if it is exact. It may be cautious, but not be too sure."""
    _, normalised, distances = sample(HEADING_ERROR)
    assert 0.5 < normalised.mean() < 2.5
    for low in (1.5, 3.0, 4.5, 6.0):
        here = (distances >= low) & (distances < low + 1.5)
        assert 0.4 < normalised[here].mean() < 3.0, f"{low} m"
    assert (normalised > 16.0).mean() < 0.001, "so that tracking takes it for what it is"


def test_the_error_is_told_along_the_line_of_sight_and_across_it() -> None:
    rng = np.random.default_rng(0)
    for bearing in (0.0, 0.7, math.pi / 2, 2.5, -2.0):
        centre = 6.0 * math.cos(bearing), 6.0 * math.sin(bearing)
        sighting = seen_at(centre, bearing, bearing, rng, error=0.0)
        assert sighting is not None
        covariance = covariance_of(sighting)
        axes = np.linalg.eigh(covariance)[1]
        sight = np.array([math.cos(bearing), math.sin(bearing)])
        assert max(abs(axes.T @ sight)) == pytest.approx(1.0, abs=1e-3)
        assert np.linalg.eigvalsh(covariance).min() > 0.0


def three(pose: Pose) -> Scan:
    """Three returns at 3 m."""
    return make_scan([3.0] * 3, pose, mount=0.0, angle_min=-0.02, angle_step=0.02, range_max=8)


def test_a_robot_that_is_straight_ahead_by_hand_and_one_return_is_enough_for_a_place() -> None:
    """The centre is 3 m and 0.6 radii ahead of the laser."""
    sighting = sighting_of(three(Pose(1.0, 2.0, math.pi / 2)), np.array([0, 1, 2]), radius=0.5, time=7.0)
    assert (sighting.x, sighting.y, sighting.time) == pytest.approx((1.0, 2.0 + 3.0 + 0.3, 7.0))
    assert sighting.xy == pytest.approx(0.0, abs=1e-12)
    assert sighting.yy == pytest.approx(BODY_ERROR**2)
    scan = make_scan([3.0, 4.0], Pose(0.0, 0.0, 0.0), mount=0.0, angle_min=0.0, angle_step=0.1, range_max=8.0)
    sighting = sighting_of(scan, np.array([1]), radius=0.5, time=0.0)
    assert (sighting.x, sighting.y) == pytest.approx((4.3 * math.cos(0.1), 4.3 * math.sin(0.1)))


@cache
def half_hidden(count: int = 800) -> tuple[Floats, Floats]:
    """The errors along the line of sight and out of the laser's view, m, and the squared normalised errors, of robots
    at the end of what it sweeps."""
    rng = np.random.default_rng(6)
    errors, normalised = [], []
    while len(errors) < count:
        away, side = rng.uniform(NEAREST, FARTHEST), int(rng.choice([-1, 1]))
        heading = -side * (math.pi / 2 + rng.uniform(-0.45, 0.45) / away)
        sighting = seen_at((away, 0.0), rng.uniform(-math.pi, math.pi), heading, rng, error=0.0)
        if sighting is not None:
            d = np.array([sighting.x - away, sighting.y])
            errors.append((d[0], d[1] * side))
            normalised.append(float(d @ np.linalg.solve(covariance_of(sighting), d)))
    return np.array(errors), np.array(normalised)


def test_a_robot_of_which_the_laser_sees_a_part_is_not_taken_for_that_part() -> None:
    errors, normalised = half_hidden()
    assert abs(errors.mean(axis=0)).max() < 0.06
    assert errors.std(axis=0).max() < 0.15
    assert 0.5 < normalised.mean() < 2.5
    assert (normalised > 16.0).mean() < 0.005


def test_a_robot_behind_a_post_goes_on_behind_it() -> None:
    """The post hides the right half of a robot that is 4 m away."""
    width = math.radians(1.0)

    def with_post(post: float) -> Sighting:
        ranges = [post] * 5 + [4.0] * 7
        scan = make_scan(ranges, Pose(0, 0, 0), mount=0.0, angle_min=-5 * width, angle_step=width, range_max=8)
        return sighting_of(scan, np.arange(5, 11), radius=0.5, time=0.0)

    hidden, seen = with_post(1.0), with_post(8.0)
    end = 4.3 * math.sin(5 * width)
    assert seen.y == pytest.approx(end / 2, abs=0.01)
    assert hidden.y == pytest.approx(end - HALF_WIDTH * 0.5, abs=0.02)
    assert hidden.xx > seen.xx
    assert hidden.yy > seen.yy


def test_an_uncertain_pose_makes_what_is_seen_from_it_uncertain() -> None:
    scan, beams = three(Pose(1.0, 2.0, 0.0)), np.array([0, 1, 2])
    sure = sighting_of(scan, beams, radius=0.5, time=0.0, uncertainty=Uncertainty(0.0, 0.0, 0.0, 0.0))
    unsure = sighting_of(scan, beams, radius=0.5, time=0.0, uncertainty=Uncertainty(0.04, 0.01, 0.09, 0.25))
    assert (unsure.x, unsure.y) == (sure.x, sure.y)
    assert unsure.xx - sure.xx == pytest.approx(0.04)
    assert unsure.xy - sure.xy == pytest.approx(0.01)
    assert unsure.yy - sure.yy == pytest.approx(0.09 + 3.3**2 * 0.25)


@given(st.floats(0, 1e10), st.floats(0, 1e10), st.floats(-1, 1), st.floats(0, 1e10), st.floats(-math.pi, math.pi))
def test_also_what_a_lost_robot_sees_can_be_sent(xx: float, yy: float, share: float, turn: float, theta: float) -> None:
    lost = Uncertainty(xx, share * math.sqrt(xx * yy), yy, turn)
    seen = sighting_of(three(Pose(1.0, 2.0, theta)), np.array([0, 1, 2]), radius=0.5, time=0.0, uncertainty=lost)
    assert checked(Sightings(seen=(seen,))).seen == (seen,)
