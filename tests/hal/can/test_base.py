"""Wheels from axes, and odometry that survives wraps, float32 and drives that start again."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.geometry import along_arc, compose
from vrg.hal.can.base import TURN, DriveBase, EncoderEstimate, WheelAxis
from vrg.hal.models import robot_model
from vrg.types import Pose

MODEL = robot_model("P2AT")
RATIO = 50.0
speeds = st.floats(-6.0, 6.0)


def base(*axes: WheelAxis) -> DriveBase:
    return DriveBase(axes or (WheelAxis(0, 0, 1, RATIO), WheelAxis(1, 1, 1, RATIO)), MODEL)


@given(speeds, speeds, st.sampled_from([1, -1]), st.sampled_from([1, -1]), st.floats(0.5, 200.0))
def test_setpoints_and_wheels_are_inverse(left: float, right: float, a: int, b: int, ratio: float) -> None:
    four = base(
        WheelAxis(0, 0, a, ratio), WheelAxis(1, 0, b, 2 * ratio),
        WheelAxis(2, 1, b, ratio), WheelAxis(3, 1, a, ratio / 2),
    )  # fmt: skip
    back = four.speeds(dict(four.setpoints(MODEL.drivetrain.twist((left, right)))))
    assert back == (pytest.approx(left, abs=1e-9), pytest.approx(right, abs=1e-9))


def test_direction_and_ratio_have_the_meaning_they_are_said_to_have() -> None:
    two = base(WheelAxis(0, 0, 1, RATIO), WheelAxis(1, 1, -1, RATIO))
    assert two.setpoints(MODEL.drivetrain.twist((TURN, TURN))) == [(0, pytest.approx(50.0)), (1, pytest.approx(-50.0))]


class Run:
    """A robot whose encoders are read every 10 ms, through float32, with an offset and a wrap."""

    def __init__(self, offset: float = 0.0, wrap: float = 0.0, directions: tuple[int, int] = (1, 1)) -> None:
        self.base = base(WheelAxis(0, 0, directions[0], RATIO), WheelAxis(1, 1, directions[1], RATIO))
        self._directions = directions
        self._turns = [0.0, 0.0]
        self._speeds = [0.0, 0.0]
        self._offset, self._wrap = offset, wrap
        self._now = 0.0
        self.steps(0.0, 0.0, 1)

    def steps(self, left: float, right: float, count: int) -> None:
        """Drive at these wheel speeds, rad/s."""
        for _ in range(count):
            self._now += 0.01
            for node, speed in enumerate((left, right)):
                self._speeds[node] = speed / TURN * RATIO * self._directions[node]
                self._turns[node] += self._speeds[node] * 0.01
                assert self.base.update(node, self.estimate(node), self._wrap) is not None

    def estimate(self, node: int) -> EncoderEstimate:
        """As the wire has it."""
        position = self._turns[node] + self._offset
        if self._wrap:
            position = (position + self._wrap / 2) % self._wrap - self._wrap / 2
        return EncoderEstimate(float(np.float32(position)), self._speeds[node], self._now)


@given(
    st.lists(st.tuples(speeds, speeds, st.integers(1, 60)), min_size=1, max_size=8),
    st.sampled_from([0.0, -3e4, 2.5e5]),
    st.sampled_from([0.0, 100.0, 4096.0]),
)
def test_odometry_follows_the_wheels(legs: list[tuple[float, float, int]], offset: float, wrap: float) -> None:
    run = Run(offset, wrap, (1, -1))
    there = Pose(0.0, 0.0, 0.0)
    for left, right, count in legs:
        run.steps(left, right, count)
        for _ in range(count):
            there = along_arc(there, MODEL.drivetrain.twist((left, right)), 0.01)
    pose = run.base.pose
    # float32 steps by 1/32 turn of a motor at 250 000 turns: half a millimetre at the wheel, whatever the way.
    assert math.hypot(pose.x - there.x, pose.y - there.y) < 0.004 + 0.002 * math.hypot(there.x, there.y)
    assert abs(math.remainder(pose.theta - there.theta, TURN)) < 0.004
    assert run.base.angles[0] == pytest.approx(sum(left * n * 0.01 for left, _, n in legs), abs=0.01)


def test_a_coarse_float32_does_not_drift() -> None:
    """At 4 million turns a float32 steps by half a turn, and a slow wheel moves a tenth of that between frames."""
    run = Run(offset=4e6)
    run.steps(0.6, 0.6, 2000)
    assert run.base.pose.x == pytest.approx(
        0.6 * 20.0 * MODEL.drivetrain.wheel_radius, abs=0.5 / RATIO * TURN * MODEL.drivetrain.wheel_radius
    )


def test_the_first_estimate_is_no_movement() -> None:
    fresh = base()
    assert fresh.update(0, EncoderEstimate(1234.5, 0.0, 1.0)) == 0.0
    assert fresh.update(1, EncoderEstimate(-99.0, 0.0, 1.0)) == 0.0
    assert fresh.pose == Pose(0.0, 0.0, 0.0)


@pytest.mark.parametrize(("jump", "speed"), [(1000.0, 3.0), (-1000.0, 3.0), (25.0, 3.0), (3.0, 0.0)])
def test_a_jump_is_told_and_not_believed(jump: float, speed: float) -> None:
    """At rest a small one too."""
    run = Run()
    run.steps(speed, speed, 50)
    before = run.base.pose
    run._turns[0] += jump
    run._now += 0.01
    assert run.base.update(0, run.estimate(0)) is None
    assert run.base.update(1, run.estimate(1)) is not None
    assert math.hypot(run.base.pose.x - before.x, run.base.pose.y - before.y) < 0.01
    run.steps(speed, speed, 50)
    assert run.base.pose.x - before.x == pytest.approx(0.5 * speed * MODEL.drivetrain.wheel_radius, rel=0.1, abs=0.001)


def test_a_way_is_told_in_turns_of_the_motor() -> None:
    run = Run(wrap=4096.0)
    run._turns[0] += 2.0
    run._now += 0.01
    assert run.base.update(0, run.estimate(0), 4096.0) == pytest.approx(2.0)


def test_a_frame_that_was_late_is_no_jump() -> None:
    run = Run()
    run.steps(6.0, 6.0, 20)
    for node in (0, 1):
        run._turns[node] += 6.0 / TURN * RATIO * 0.15  # 0.15 s of way, although the stamps are 1 ms apart
    run._now += 0.001
    assert run.base.update(0, run.estimate(0)) is not None
    assert run.base.update(1, run.estimate(1)) is not None


def test_rebase_forgets_where_the_encoders_were_but_not_the_pose() -> None:
    run = Run()
    run.steps(3.0, 2.0, 50)
    pose = run.base.pose
    run.base.rebase()
    run._turns = [0.0, 0.0]
    run.steps(0.0, 0.0, 2)
    assert run.base.pose == pose
    run.base.restart()
    assert run.base.pose == Pose(0.0, 0.0, 0.0)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3), st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3))
def test_compose(x: float, y: float, theta: float, dx: float, dy: float, turn: float) -> None:
    pose = compose(Pose(x, y, theta), Pose(dx, dy, turn))
    frame = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    assert np.allclose((pose.x, pose.y), np.array([x, y]) + frame @ np.array([dx, dy]))
    assert math.remainder(pose.theta - theta - turn, TURN) == pytest.approx(0.0, abs=1e-9)
