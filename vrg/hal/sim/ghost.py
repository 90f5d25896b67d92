"""Where a physical robot is by its measured poses, also between them. Pure.

Measurements come at 10 Hz or so, the world ticks at 50 Hz: in between the body goes on along its arc, but not for long.
"""

import math

from vrg.bus.node import CLOCK_SKEW
from vrg.errors import WorldError
from vrg.types import Pose

EXTRAPOLATE = 0.2
"""s of match time past a measurement for which the body goes on at the measured velocity; then it stays."""
_FAR = 1e5
"""m; the largest coordinate that a message may hold."""


class Ghost:
    """One physical robot.

    Args:
        pose: where it is taken to stand until it is measured.
        stamp: match time from which the age of that is counted, s.
    """

    def __init__(self, pose: Pose, stamp: float) -> None:
        self._pose = pose
        self._stamp = stamp
        self._v = self._w = 0.0

    def measure(self, pose: Pose, v: float, w: float, stamp: float, now: float) -> None:
        """Take in a measurement; one that is older than the newest changes nothing.

        Args:
            v, w: body velocity, m/s and rad/s. stamp: when it was measured, match time in s. now: match time, s.

        Raises:
            WorldError: it is stamped in the future by more than clocks differ.
        """
        if stamp > now + CLOCK_SKEW:
            raise WorldError(f"expected a pose of now ({now:.2f} s) or before, got one of {stamp:.2f} s")
        if stamp >= self._stamp:
            self._pose, self._v, self._w, self._stamp = pose, v, w, stamp

    def age(self, now: float) -> float:
        """s of match time since it was measured."""
        return max(0.0, now - self._stamp)

    def at(self, now: float) -> tuple[Pose, float, float]:
        """Its pose at match time `now`, and its body velocity there: m/s and rad/s, 0 once it is not known any more."""
        age = self.age(now)
        pose = along_arc(self._pose, self._v, self._w, min(age, EXTRAPOLATE))
        pose = Pose(max(-_FAR, min(pose.x, _FAR)), max(-_FAR, min(pose.y, _FAR)), pose.theta)
        return (pose, self._v, self._w) if age <= EXTRAPOLATE else (pose, 0.0, 0.0)


def along_arc(pose: Pose, v: float, w: float, seconds: float) -> Pose:
    """Where a body at `pose` is after going on at v m/s and w rad/s for so long."""
    half = w * seconds / 2
    chord = v * seconds * (math.sin(half) / half if half else 1.0)
    middle = pose.theta + half
    return Pose(pose.x + chord * math.cos(middle), pose.y + chord * math.sin(middle), pose.theta + 2 * half)
