"""A calibration from what a match has shown: with it, odometry measures what the robot does."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.hal.can.base import WheelAxis
from vrg.hal.models import robot_model
from vrg.hal.models.drivetrain import Drivetrain
from vrg.testing.omni import OMNI
from vrg.types import Twist
from vrg_locate.fitting.calibration import fitted

SKID = robot_model("P2AT").drivetrain
shares = st.floats(-0.05, 0.05)


def moves(drivetrain: Drivetrain, wheels: list[WheelAxis], motors: dict[int, float], larger: list[float]) -> Twist:
    """The motion of a robot whose motors turn so fast, rad/s, if the wheels of its axes are larger by these shares."""
    speeds = [0.0] * len(drivetrain.axes)
    for wheel in wheels:
        speeds[wheel.axis] = motors[wheel.node] * wheel.direction / wheel.ratio * (1.0 + larger[wheel.axis])
    return drivetrain.twist(speeds)


@given(shares, shares, shares)
def test_ratios_and_track_of_a_robot_with_skid_steer_are_found(left: float, right: float, wider: float) -> None:
    """The wheels of its sides are larger by shares of their own, and its track is wider."""
    wheels = [WheelAxis(4, 0, 1, 50.0), WheelAxis(7, 1, -1, 48.0, "3A65B1C0")]
    true = SKID.with_track(SKID.effective_track * (1.0 + wider))

    def truth(motors: dict[int, float]) -> Twist:
        return moves(true, wheels, motors, [left, right])

    straight = {4: 50.0, 7: -48.0}
    turning = {4: -50.0, 7: -48.0}
    by_odometry, really = moves(SKID, wheels, straight, [0.0, 0.0]), truth(straight)
    errors = {"way": really.v / by_odometry.v - 1.0, "bend": really.w / by_odometry.v}
    errors["turn"] = truth(turning).w / moves(SKID, wheels, turning, [0.0, 0.0]).w - 1.0
    found = fitted("sue", wheels, SKID, **errors)
    assert {node: axis.direction for node, axis in found.axes.items()} == {4: 1, 7: -1}
    assert {node: axis.serial for node, axis in found.axes.items()} == {4: "", 7: "3A65B1C0"}
    known = [WheelAxis(w.node, w.axis, w.direction, found.axes[w.node].ratio) for w in wheels]
    for motors in (straight, turning, {4: 20.0, 7: -60.0}):
        measured, really = moves(SKID.with_track(found.track), known, motors, [0.0, 0.0]), truth(motors)
        assert (measured.v, measured.w) == pytest.approx((really.v, really.w), abs=1e-9)


def test_a_robot_without_errors_keeps_its_calibration_whatever_its_drivetrain_is() -> None:
    wheels = [WheelAxis(number, number, 1, 20.0) for number in range(len(OMNI.drivetrain.axes))]
    found = fitted("omni", wheels, OMNI.drivetrain, way=0.0, turn=0.0, bend=0.0)
    assert [axis.ratio for axis in found.axes.values()] == [20.0] * len(wheels)
    assert found.track == pytest.approx(OMNI.drivetrain.effective_track)
    longer = fitted("omni", wheels, OMNI.drivetrain, way=0.02, turn=0.02, bend=0.0)
    assert math.isclose(longer.track, OMNI.drivetrain.effective_track, rel_tol=0.02)
