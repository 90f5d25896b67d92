"""Where a physical robot is between its measurements."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.bus.messages import LOST, MeasuredPose
from vrg.bus.node import CLOCK_SKEW
from vrg.errors import WorldError
from vrg.geometry import along_arc
from vrg.hal.sim.robot import EXTRAPOLATE, Ghost
from vrg.types import STILL, Pose, Twist, Uncertainty

places = st.floats(-100, 100)
poses = st.builds(Pose, places, places, st.floats(-math.pi, math.pi))


@given(pose=poses, v=st.floats(-2, 2), side=st.floats(-2, 2), w=st.floats(-5, 5), seconds=st.floats(0, EXTRAPOLATE))
def test_the_arc_is_what_many_small_steps_give(pose: Pose, v: float, side: float, w: float, seconds: float) -> None:
    steps = 300
    x, y, theta = pose.x, pose.y, pose.theta
    dt = seconds / steps
    for _ in range(steps):
        c, s = math.cos(theta + w * dt / 2), math.sin(theta + w * dt / 2)
        x += (v * c - side * s) * dt
        y += (v * s + side * c) * dt
        theta += w * dt
    there = along_arc(pose, Twist(v, w, side), seconds)
    assert (there.x, there.y, there.theta) == pytest.approx((x, y, theta), abs=1e-6)


@given(now=st.floats(0, 10), v=st.floats(-100, 100), w=st.floats(-1000, 1000))
def test_it_never_goes_on_for_longer_than_it_may(now: float, v: float, w: float) -> None:
    ghost = Ghost("g", Pose(9, 9, 0), 0.0)
    ghost.measure(MeasuredPose(pose=Pose(0, 0, 0), twist=Twist(v, w)), 0.0, 0.0)
    pose, _ = ghost.at(now)
    assert math.hypot(pose.x, pose.y) <= abs(v) * EXTRAPOLATE + 1e-9
    assert ghost.age(now) == now


def test_the_newest_measurement_counts_whatever_order_they_come_in() -> None:
    ghost = Ghost("g", Pose(0, 0, 0), 0.0)
    ghost.measure(MeasuredPose(pose=Pose(2, 0, 0), twist=STILL), 1.0, 1.1)
    ghost.measure(MeasuredPose(pose=Pose(1, 0, 0), twist=STILL), 0.9, 1.1)
    assert ghost.at(1.1)[0].x == 2
    ghost.measure(MeasuredPose(pose=Pose(3, 0, 0), twist=STILL), 1.0, 1.1)
    assert ghost.at(1.1)[0].x == 3


def test_clocks_may_differ_a_little_but_nobody_measures_the_future() -> None:
    ghost = Ghost("g", Pose(0, 0, 0), 0.0)
    ghost.measure(MeasuredPose(pose=Pose(1, 0, 0), twist=Twist(0.5, 0.0)), 1.0 + CLOCK_SKEW, 1.0)
    assert (ghost.age(1.0), ghost.at(1.0)) == (0.0, (Pose(1, 0, 0), Twist(0.5, 0.0)))
    with pytest.raises(WorldError, match="or earlier"):
        ghost.measure(MeasuredPose(pose=Pose(2, 0, 0), twist=STILL), 1.3, 1.0)
    assert ghost.at(1.0)[0].x == 1


def test_the_edge_of_what_a_message_may_hold_is_not_passed() -> None:
    ghost = Ghost("g", Pose(1e5, -1e5, 0), 0.0)
    ghost.measure(MeasuredPose(pose=Pose(1e5, -1e5, -0.5), twist=Twist(100.0, 0.0)), 0.0, 0.0)
    pose, _ = ghost.at(0.2)
    assert (pose.x, pose.y) == (1e5, -1e5)


def test_the_age_of_a_robot_that_is_lost_counts_from_when_it_was_seen() -> None:
    ghost, known = Ghost("g", Pose(0, 0, 0), 0.0), Uncertainty(0.01, 0.0, 0.01, 0.1)
    ghost.measure(MeasuredPose(pose=Pose(1, 0, 0), uncertainty=known, unseen=LOST), 5.0, 5.0)
    assert (ghost.age(5.1), ghost.uncertainty) == (pytest.approx(0.1), known)
    ghost.measure(MeasuredPose(pose=Pose(1, 0, 0), twist=Twist(1.0, 0.0), unseen=LOST + 0.1), 6.0, 6.0)
    assert ghost.age(6.1) == pytest.approx(0.1 + LOST + 0.1)
    assert ghost.at(6.1)[0].x == pytest.approx(1.1), "where its odometry places it"
    ghost.measure(MeasuredPose(pose=Pose(1, 0, 0), unseen=1e8), 7.0, 7.0)
    assert ghost.age(7.0) == 7.0
