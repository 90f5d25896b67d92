"""The pose of a physical robot according to its measured poses, also between two measurements.

Measurements come at about 10 Hz, and the world ticks at 50 Hz. Between two measurements the body goes on along its arc,
but not for long. This module uses no bus and no clock.
"""

from vrg.bus.messages import MeasuredPose
from vrg.bus.node import CLOCK_SKEW
from vrg.errors import WorldError
from vrg.geometry import along_arc
from vrg.types import STILL, Pose, Twist, Uncertainty

EXTRAPOLATE = 0.2
"""The match time in s after a measurement for which the body goes on at the measured velocity; then it stands still."""
_FAR = 1e5
"""The largest coordinate that a message may hold, m."""


class Ghost:
    """One physical robot, as the world shows it.

    Args:
        pose: where the robot is taken to stand until it is measured.
        stamp: the match time from which the age of that pose is counted, s.

    Attributes:
        uncertainty: how well its pose is known; None if that is not known.
    """

    def __init__(self, pose: Pose, stamp: float) -> None:
        self._pose = pose
        self._stamp = self._seen = stamp
        self._twist = STILL
        self.uncertainty: Uncertainty | None = None

    def measure(self, measured: MeasuredPose, stamp: float, now: float) -> None:
        """Take in a measurement; one that is older than the newest changes nothing.

        Args:
            stamp: the match time of the measurement, s. now: the match time, s.

        Raises:
            WorldError: the stamp is in the future by more than CLOCK_SKEW.
        """
        if stamp > now + CLOCK_SKEW:
            raise WorldError(f"expected a pose of now ({now:.2f} s) or before, got one of {stamp:.2f} s")
        if stamp >= self._stamp:
            self._pose, self._twist, self._stamp = measured.pose, measured.twist, stamp
            self._seen = max(0.0, stamp - measured.unseen) if measured.lost else stamp
            self.uncertainty = measured.uncertainty

    def age(self, now: float) -> float:
        """The match time since the robot was measured, or since it was last seen if it is lost, s."""
        return max(0.0, now - self._seen)

    def at(self, now: float) -> tuple[Pose, Twist]:
        """Its pose at match time `now` and the velocity of its body, which is 0 once it stands still."""
        age = max(0.0, now - self._stamp)
        pose = along_arc(self._pose, self._twist, min(age, EXTRAPOLATE))
        pose = Pose(max(-_FAR, min(pose.x, _FAR)), max(-_FAR, min(pose.y, _FAR)), pose.theta)
        return pose, self._twist if age <= EXTRAPOLATE else STILL
