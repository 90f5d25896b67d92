"""Feedback linearisation, equation by equation, and that it drives a unicycle where it should."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.navigation.control import Twist, go_to, limit, linearise, offset_point, scaled, track
from vrg.types import Pose

angles = st.floats(-math.pi, math.pi)
speeds = st.floats(-2, 2)
offsets = st.floats(0.05, 1)


def drive(pose: Pose, twist: Twist, dt: float) -> Pose:
    """A unicycle, eq. 2.1, at its middle heading."""
    middle = pose.theta + twist.w * dt / 2
    return Pose(
        pose.x + twist.v * math.cos(middle) * dt, pose.y + twist.v * math.sin(middle) * dt, pose.theta + twist.w * dt
    )


@given(speeds, speeds, angles, offsets)
def test_the_offset_point_moves_with_the_wanted_velocity(ux: float, uy: float, theta: float, d: float) -> None:
    pose = Pose(1.0, -2.0, theta)
    twist = linearise((ux, uy), theta, d)
    dt = 1e-6
    before, after = offset_point(pose, d), offset_point(drive(pose, twist, dt), d)
    assert (after[0] - before[0]) / dt == pytest.approx(ux, abs=1e-3)
    assert (after[1] - before[1]) / dt == pytest.approx(uy, abs=1e-3)


@given(angles, st.floats(-5, 5), st.floats(-5, 5))
def test_the_offset_point_converges_on_the_goal_from_any_heading(theta: float, gx: float, gy: float) -> None:
    pose, d = Pose(0.0, 0.0, theta), 0.25
    for _ in range(1500):
        u = track((gx, gy), (0.0, 0.0), pose, d, 1.0)
        pose = drive(pose, linearise(u, pose.theta, d), 0.01)
    assert math.dist(offset_point(pose, d), (gx, gy)) < 0.01


def test_a_moving_goal_is_followed_without_lag() -> None:
    pose, d, velocity = Pose(0.0, 0.0, 0.0), 0.25, (0.3, 0.4)
    goal = (2.0, 1.0)
    for i in range(3000):
        goal = (2.0 + velocity[0] * i * 0.01, 1.0 + velocity[1] * i * 0.01)
        pose = drive(pose, linearise(track(goal, velocity, pose, d, 1.0), pose.theta, d), 0.01)
    assert math.dist(offset_point(pose, d), goal) < 0.02


@given(speeds, speeds, st.floats(0.01, 3))
def test_a_limited_velocity_keeps_its_direction(x: float, y: float, most: float) -> None:
    u = limit((x, y), most)
    assert math.hypot(*u) <= most + 1e-9
    assert u[0] * y == pytest.approx(u[1] * x, abs=1e-9)


def test_the_zero_vector_has_no_direction() -> None:
    assert scaled((0.0, 0.0), 3.0) == (0.0, 0.0)


@given(angles, angles, st.floats(-3, 3), st.floats(-3, 3))
def test_going_to_a_pose_ends_near_it_with_its_heading(start: float, end: float, x: float, y: float) -> None:
    pose, goal = Pose(0.0, 0.0, start), Pose(x, y, end)
    for _ in range(4000):
        pose = drive(pose, go_to(goal, pose, d=0.25, speed=0.7, reach=0.5), 0.01)
    assert math.dist((pose.x, pose.y), (x, y)) < 0.55
    assert abs(math.remainder(pose.theta - end, 2 * math.pi)) < 0.06
