"""The estimate of where a thing is, and how fast: from fixes alone, as a ball has no odometry.

It fits a steady motion to the fixes, of which each counts the less the older it is: the fading-memory filter of first
degree (E. Brookner, Tracking and Kalman Filtering Made Easy, 1998). This module uses no bus and no clock.
"""

import math
from typing import Final

import numpy as np

from vrg.bus.messages import LOST, Fix, MeasuredPose
from vrg.portable.scalars import cos_sin, exp, hypot, square
from vrg.types import Pose, Twist

FASTEST: Final = 10.0
"""The speed in m/s beyond which nothing moves: what is seen farther away was carried, or is something else."""
SLACK: Final = 0.2
"""The way in m beyond that within which fixes may differ, as those of two cameras."""
_MEMORY: Final = 0.04
"""The time in s after which a fix counts 1/e as much. After a kick the velocity is right three times as late."""


class ThingEstimator:
    """The estimate of one thing. Its turn rate is not estimated: it heads where it was seen to."""

    def __init__(self) -> None:
        self._time, self._heading = -math.inf, 0.0
        self._place, self._velocity = np.zeros(2), np.zeros(2)

    def correct(self, time: float, fix: Fix) -> MeasuredPose | None:
        """Take in a fix, and return where the thing was then; None if the fix is not newer than the last one.

        After LOST without a fix, and after a leap that is too fast for any motion, the thing is taken to stand there.

        Args:
            time: when it was captured, s.
        """
        if (dt := time - self._time) <= 0.0:
            return None
        self._time, seen = time, np.array([fix.pose.x, fix.pose.y])
        if dt > LOST or hypot(*(seen - self._place).tolist()) > FASTEST * dt + SLACK:
            self._place, self._velocity = seen, np.zeros(2)
        else:
            kept, ahead = exp(-dt / _MEMORY), self._place + dt * self._velocity
            self._place = ahead + (1.0 - square(kept)) * (seen - ahead)
            self._velocity = self._velocity + square(1.0 - kept) / dt * (seen - ahead)
        if fix.heading is not None:
            self._heading = fix.pose.theta
        (x, y), (vx, vy), (cos, sin) = self._place.tolist(), self._velocity.tolist(), cos_sin(self._heading)
        return MeasuredPose(pose=Pose(x, y, self._heading), twist=Twist(vx * cos + vy * sin, 0.0, vy * cos - vx * sin))
