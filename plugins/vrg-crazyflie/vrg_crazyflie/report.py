"""What a Crazyflie reports, by the two log blocks that the driver starts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntFlag
from typing import Final

from msgspec.structs import replace

from vrg.geometry import compose, inverse
from vrg.types import LEVEL, Pose, Twist

MOTION: Final = {
    "stateEstimate.x": "float", "stateEstimate.y": "float", "stateEstimate.z": "float", "stateEstimate.vx": "float",
    "stateEstimate.vy": "float", "stateEstimate.yaw": "float", "stateEstimateZ.rateYaw": "int16_t",
}  # fmt: skip
"""The variables of the block of the motion and the types in which they are sent: 26 bytes, as many as a block holds."""
STATUS: Final = {
    "supervisor.info": "uint16_t", "pm.vbat": "float", "pm.state": "int8_t", "pm.batteryLevel": "uint8_t",
    "stabilizer.thrust": "float",
}  # fmt: skip
"""The variables of the block of the status."""
IDLE_THRUST: Final = 5_000.0
"""The thrust, of 65535, up to which it stands on the ground: it hovers at some 36,000."""
LOW_POWER: Final = (3, 4)
"""The values of pm.state of a battery that is low, and of one that is about to be switched off (pm.h)."""
MOTION_PERIOD, STATUS_PERIOD = 20, 100
"""The time in ms from one report to the next."""
Info = IntFlag("Info", "CAN_BE_ARMED ARMED AUTO_ARM CAN_FLY FLYING TUMBLED LOCKED CRASHED "
                       "PLAN_ACTIVE PLAN_FINISHED PLAN_DISABLED DECK_FAULT")  # fmt: skip
"""The bits of supervisor.info, from the lowest on (crazyflie-firmware 2026.08, supervisor.c)."""


@dataclass(frozen=True)
class Motion:
    """The state that the estimator on board reports.

    Args:
        heard: the time at which it was heard, s.
        x, y, z: the position in the estimator's frame, m. yaw: the heading in it, rad, within -pi to pi.
        vx, vy: the velocity in that frame, m/s. w: the turn rate, rad/s.
    """

    heard: float
    x: float
    y: float
    z: float
    vx: float
    vy: float
    yaw: float
    w: float

    @property
    def is_finite(self) -> bool:
        """True if all numbers are finite."""
        return math.isfinite(self.x + self.y + self.z + self.vx + self.vy + self.yaw + self.w)

    @property
    def twist(self) -> Twist:
        """The velocity in the frame of the body."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Twist(cos * self.vx + sin * self.vy, self.w, cos * self.vy - sin * self.vx)


def motion_of(values: Mapping[str, float], heard: float) -> Motion:
    """The motion in a log block; the firmware has degrees and thousandths of a radian."""
    x, y, z, vx, vy, yaw, w = (values[name] for name in MOTION)
    return Motion(heard, x, y, z, vx, vy, math.radians(yaw), w / 1000.0)


@dataclass(frozen=True)
class Status:
    """The state of the supervisor and of the battery.

    Args:
        heard: the time at which it was heard, s. info: the supervisor's bits.
        volts: the battery's voltage under its present load, V. power: pm.state; see LOW_POWER.
        charge: what is left of the battery, 0 to 1.
        thrust: what the controller asks of the motors, 0 to 65535.
    """

    heard: float
    info: Info
    volts: float
    power: int
    charge: float
    thrust: float

    @property
    def flies(self) -> bool:
        """True if its motors hold it in the air; the firmware says so for some time after that, too."""
        return Info.FLYING in self.info and self.thrust > IDLE_THRUST


def status_of(values: Mapping[str, float], heard: float) -> Status:
    """The status in a log block."""
    info, volts, power, level, thrust = (values[name] for name in STATUS)
    return Status(heard, Info(int(info)), volts, int(power), min(1.0, max(0.0, level / 100.0)), thrust)


class Way:
    """The way of a Crazyflie since VRG first heard it, which goes on where it was if the estimator begins anew."""

    def __init__(self) -> None:
        self.pose = Pose(0.0, 0.0, 0.0)
        self._origin: Pose | None = None
        """The pose on the way of the estimator's own (0, 0, 0). It begins anew on the ground."""

    def anew(self) -> None:
        """The next report is the first one of an estimator that has begun anew, at the place of the last one."""
        self._origin = None

    def move(self, motion: Motion, *, aloft: bool = False) -> None:
        """Take in a report; `aloft` if it is not on the ground.

        The heading grows beyond pi if the robot goes on turning.
        """
        there = Pose(motion.x, motion.y, motion.yaw, motion.z)
        if self._origin is None:
            here = replace(self.pose, z=motion.z if aloft else LEVEL)
            self._origin = compose(here, inverse(there))
        now = compose(self._origin, there)
        turned = math.remainder(now.theta - self.pose.theta, math.tau)
        self.pose = Pose(now.x, now.y, self.pose.theta + turned, max(0.0, now.z) or LEVEL)
