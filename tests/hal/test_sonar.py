"""Ultrasonic rings: cones against brute force, the Pioneer's ring, noise and limits."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vrg.hal.models import robot_model
from vrg.hal.sensors.sonar import Sonar, SonarSpec
from vrg.hal.sim.map import Map
from vrg.hal.sim.sensors.base import Instant, Surroundings
from vrg.hal.sim.sensors.rays import Edges, Fan, cast, nearest_in_cones
from vrg.hal.sim.sensors.suite import SensorSuite
from vrg.hal.sim.shapes import Box, box_edges
from vrg.regions import Circle, Rectangle
from vrg.types import Pose

P2AT = robot_model("P2AT")
RING = next(spec for spec in P2AT.sensors if isinstance(spec, SonarSpec))


def test_a_cone_hears_the_nearest_of_many_rays() -> None:
    wrong = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        boxes = rng.uniform((-5, -5, -3, 0.2, 0.2), (5, 5, 3, 3, 3), (rng.integers(0, 6), 5))
        discs = rng.uniform((-5, -5, 0.1), (5, 5, 1.5), (rng.integers(0, 3), 3))
        x, y, heading = rng.uniform(-5, 5, 3)
        cone = float(rng.uniform(0.1, 2.5))
        edges = Edges(box_edges(boxes))
        [heard] = nearest_in_cones(np.array([[x, y, heading]]), cone, 8.0, edges, discs)
        rays = cast(x, y, heading, Fan.of(4001, cone), 8.0, edges, discs).min()
        if not rays - 0.02 <= heard <= rays + 1e-6:
            wrong.append(f"seed {seed}: {heard} m, by rays {rays} m")
    assert not wrong, "\n".join(wrong)


def heard(
    poses: list[tuple[float, float, float]], *, noise: bool = False, spec: SonarSpec = RING, **walls: object
) -> Sonar:
    """What the first of these robots hears."""
    map_ = Map("yard", Rectangle(-20, -20, 20, 20), walls.get("boxes", ()), walls.get("circles", ()))  # type: ignore[arg-type]
    model = replace(P2AT, sensors=(spec,))
    n = len(poses)
    now = Instant(0, 0.02, [model] * n, np.array(poses), np.zeros((n, 2)), np.zeros((n, 2)), [0] * n, np.ones(n))
    suite = SensorSuite(Surroundings(map_, 1, noise), [f"r{i}" for i in range(n)], [False] * n, now)
    said = {robot: message for robot, _, message in suite.sense(now)}
    found = said["r0"]
    assert isinstance(found, Sonar)
    return found


def test_the_ring_is_symmetric_and_faces_away_from_the_body() -> None:
    assert len(RING.places) == 16
    for place in RING.places:
        assert math.cos(place.theta) * place.x + math.sin(place.theta) * place.y > 0
        mirror = Pose(place.x, -place.y, -place.theta)
        assert any(
            math.dist((other.x, other.y), (mirror.x, mirror.y)) < 1e-9
            and math.isclose(math.cos(other.theta - mirror.theta), 1.0)
            for other in RING.places
        )
    degrees = [round(math.degrees(place.theta)) for place in RING.places]
    assert degrees == [90, 50, 30, 10, -10, -30, -50, -90, -90, -130, -150, -170, 170, 150, 130, 90]


def test_a_wall_to_the_left_is_heard_by_both_transducers_on_that_side() -> None:
    wall = Box(0.0, 1.25, 0.0, 10.0, 0.5)
    ranges = heard([(0.0, 0.0, 0.0)], boxes=(wall,)).ranges
    assert ranges[0] == ranges[15] == pytest.approx(1.0 - 0.136)
    assert ranges[7] == ranges[8] == RING.range_max


def test_other_robots_are_heard_and_oneself_is_not() -> None:
    alone = heard([(0.0, 0.0, 0.3)])
    assert set(alone.ranges) == {RING.range_max}
    ahead = heard([(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)])
    assert min(ahead.ranges[3:5]) == pytest.approx(2.0 - 0.245 - P2AT.length / 2, abs=0.02)
    assert set(ahead.ranges[8:]) == {RING.range_max}


def test_a_round_post_is_heard() -> None:
    ranges = heard([(0.0, 0.0, 0.0)], circles=(Circle(-2.0, 0.0, 0.3),)).ranges
    assert min(ranges[11:13]) == pytest.approx(2.0 - 0.3 - 0.245, abs=0.02)


def test_noise_grows_with_the_range_and_ranges_keep_their_limits() -> None:
    near, far = Box(0.0, 0.70, 0.0, 10.0, 1.0), Box(0.0, 5.0, 0.0, 10.0, 1.0)
    assert heard([(0.0, 0.0, 0.0)], boxes=(near,)).ranges[0] == RING.range_min, "0.064 m is too near to be measured"
    spec = replace(RING, noise=0.2, resolution=0.01)
    ranges = heard([(0.0, 0.0, 0.0)], boxes=(far,), spec=spec, noise=True).ranges
    assert ranges[0] != ranges[15], "each transducer has its own noise"
    assert all(spec.range_min <= r <= spec.range_max for r in ranges)
    assert all(abs(r / 0.01 - round(r / 0.01)) < 1e-9 for r in ranges)
