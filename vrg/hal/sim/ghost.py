"""Where a physical robot is according to its measured poses, also between two measurements.

Measurements come at about 10 Hz, and the world ticks at 50 Hz. Between two measurements the body goes on along its arc,
but not for long. This module uses no bus and no clock.
"""

import math

from vrg.bus.node import CLOCK_SKEW
from vrg.errors import WorldError
from vrg.types import Pose

EXTRAPOLATE = 0.2
"""The match time in s after a measurement for which the body goes on at the measured velocity; then it stands still."""
_FAR = 1e5
"""The largest coordinate that a message may hold, m."""


class Ghost:
    """One physical robot, as the world shows it.

    Args:
        pose: where the robot is taken to stand until it is measured.
        stamp: the match time from which the age of that pose is counted, s.
    """

    def __init__(self, pose: Pose, stamp: float) -> None:
        self._pose = pose
        self._stamp = stamp
        self._v = self._w = 0.0

    def measure(self, pose: Pose, v: float, w: float, stamp: float, now: float) -> None:
        """Take in a measurement; one that is older than the newest changes nothing.

        Args:
            v, w: body velocity, m/s and rad/s. stamp: the match time of the measurement, s. now: the match time, s.

        Raises:
            WorldError: the stamp is in the future by more than CLOCK_SKEW.
        """
        if stamp > now + CLOCK_SKEW:
            raise WorldError(f"expected a pose of now ({now:.2f} s) or before, got one of {stamp:.2f} s")
        if stamp >= self._stamp:
            self._pose, self._v, self._w, self._stamp = pose, v, w, stamp

    def age(self, now: float) -> float:
        """The match time since the newest measurement, s."""
        return max(0.0, now - self._stamp)

    def at(self, now: float) -> tuple[Pose, float, float]:
        """Its pose at match time `now` and its body velocity, m/s and rad/s, which is 0 once it stands still."""
        age = self.age(now)
        pose = along_arc(self._pose, self._v, self._w, min(age, EXTRAPOLATE))
        pose = Pose(max(-_FAR, min(pose.x, _FAR)), max(-_FAR, min(pose.y, _FAR)), pose.theta)
        return (pose, self._v, self._w) if age <= EXTRAPOLATE else (pose, 0.0, 0.0)


def along_arc(pose: Pose, v: float, w: float, seconds: float) -> Pose:
    """The pose of a body that starts at `pose` and moves at v m/s and w rad/s for `seconds`."""
    half = w * seconds / 2
    chord = v * seconds * (math.sin(half) / half if half else 1.0)
    middle = pose.theta + half
    return Pose(pose.x + chord * math.cos(middle), pose.y + chord * math.sin(middle), pose.theta + 2 * half)
