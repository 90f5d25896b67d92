"""The calibration of a robot from what a match has shown of its odometry."""

from collections.abc import Mapping, Sequence

import numpy as np

from vrg.hal.can.base import WheelAxis
from vrg.hal.can.calibration import AxisCalibration, Calibration
from vrg.hal.models.drivetrain import Drivetrain

_ROUNDS = 3
"""The number of times that shares and track are worked out one from the other."""


def fitted(
    robot: str,
    wheels: Sequence[WheelAxis],
    drivetrain: Drivetrain,
    *,
    way: float,
    turn: float,
    bend: float,
    motion: Mapping[str, float] = {},
) -> Calibration:
    """The calibration of a robot whose odometry was found to err.

    Args:
        robot: its name. wheels: its motors, as it drove. drivetrain: with the effective track by which it drove.
        way, turn: the shares by which its ways and its turns are longer than measured.
        bend: its turn to the left on a metre straight ahead, rad/m.
        motion: how it moves; see `with_motion`.

    Returns:
        the calibration with which its odometry measures what it does.
    """
    ahead, turning, _ = drivetrain.motions
    straight, spinning, _ = np.array(drivetrain.rates).T
    # The wheels of each axis are larger by a share of their own: what that does to the way and to the turn straight
    # ahead is known. Of all shares that do it, those are taken that change the least. How much it turns the robot
    # depends on the track, which depends on the shares: it is soon the same.
    spin = way
    for _ in range(_ROUNDS):
        known = np.array([way, bend * (1.0 + spin) / (1.0 + turn)])
        larger, *_ = np.linalg.lstsq(np.array([ahead, turning]) * straight, known, rcond=None)
        spin = float(np.array(turning) @ (spinning * larger))
    axes = {
        wheel.node: AxisCalibration(
            direction=wheel.direction, ratio=wheel.ratio / (1.0 + float(larger[wheel.axis])), serial=wheel.serial
        )
        for wheel in wheels
    }
    track = drivetrain.effective_track * (1.0 + spin) / (1.0 + turn)
    return Calibration(robot=robot, track=track, axes=axes, motion=dict(motion))
