"""Where a thing is, and how fast, by fixes alone."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.bus.codec import checked
from vrg.bus.messages import LOST, Fix, MeasuredPose
from vrg.geometry import compose
from vrg.localisation.thing import FASTEST, ThingEstimator
from vrg.portable.scalars import square
from vrg.types import STILL, Pose, Twist, Vector

FRAME = 1.0 / 60.0


def at(x: float, y: float = 0.0, heading: float | None = None) -> Fix:
    return Fix("ball", Pose(x, y, heading or 0.0), 0.01, None if heading is None else 0.02)


def velocity(measured: MeasuredPose) -> Vector:
    """That in the map's frame."""
    ahead = compose(Pose(0.0, 0.0, measured.pose.theta), Pose(measured.twist.v, measured.twist.side, 0.0))
    return ahead.x, ahead.y


@given(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0), st.sampled_from((None, 0.0, 2.0)))
def test_what_rolls_steadily_is_known_after_a_moment(vx: float, vy: float, heading: float | None) -> None:
    thing = ThingEstimator()
    for number in range(20):
        time = number * FRAME
        measured = thing.correct(time, at(vx * time, vy * time, heading))
    assert measured is not None
    assert velocity(measured) == pytest.approx((vx, vy), abs=0.02 * math.hypot(vx, vy) + 1e-9)
    assert (measured.pose.x, measured.pose.y) == pytest.approx((vx * time, vy * time), abs=0.01)
    assert measured.pose.theta == pytest.approx(heading or 0.0)


def test_noise_makes_little_velocity_of_what_stands() -> None:
    thing, speeds = ThingEstimator(), []
    for number in range(600):
        noise = 0.002 * math.sin(12.9898 * square(number))
        measured = thing.correct(number * FRAME, at(noise))
        assert measured is not None
        speeds.append(abs(measured.twist.v))
    assert max(speeds) < 0.1


def test_a_kick_is_followed_within_a_few_pictures() -> None:
    thing = ThingEstimator()
    for number in range(30):
        thing.correct(number * FRAME, at(0.0))
    for number in range(1, 8):
        measured = thing.correct((29 + number) * FRAME, at(6.0 * number * FRAME))
    assert measured is not None
    assert measured.twist.v == pytest.approx(6.0, rel=0.2)
    assert measured.pose.x == pytest.approx(6.0 * 7 * FRAME, abs=0.03)


def test_a_fix_that_is_not_newer_changes_nothing() -> None:
    thing = ThingEstimator()
    assert thing.correct(1.0, at(1.0)) is not None
    assert thing.correct(1.0, at(2.0)) is None
    assert thing.correct(0.9, at(2.0)) is None
    measured = thing.correct(1.1, at(1.0))
    assert measured == MeasuredPose(pose=Pose(1.0, 0.0, 0.0), twist=STILL)


@pytest.mark.parametrize(("after", "far"), [(LOST + 0.01, 1.0), (0.1, FASTEST * 0.1 + 0.3)])
def test_what_was_lost_or_has_leapt_stands_where_it_is_found(after: float, far: float) -> None:
    thing = ThingEstimator()
    for number in range(30):
        thing.correct(number * FRAME, at(number * FRAME))
    measured = thing.correct(29 * FRAME + after, at(29 * FRAME + far))
    assert measured == MeasuredPose(pose=Pose(29 * FRAME + far, 0.0, 0.0), twist=STILL)


def test_a_fix_without_a_heading_leaves_that_of_a_box() -> None:
    thing = ThingEstimator()
    thing.correct(0.0, at(0.0, 0.0, 1.5))
    measured = thing.correct(0.1, at(0.0))
    assert measured == MeasuredPose(pose=Pose(0.0, 0.0, 1.5), twist=Twist(0.0, 0.0, 0.0))


places = st.floats(-1e5, 1e5) | st.floats(-2.0, 2.0)


@given(st.lists(st.tuples(st.floats(1e-9, 1.0), places, places, st.none() | st.floats(-4.0, 4.0)), max_size=30))
def test_whatever_is_seen_can_be_published(fixes: list[tuple[float, float, float, float | None]]) -> None:
    thing, time = ThingEstimator(), 0.0
    for step, x, y, heading in fixes:
        time += step
        measured = thing.correct(time, at(x, y, heading))
        assert measured is None or checked(measured) == measured
