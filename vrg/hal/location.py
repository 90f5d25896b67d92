"""The pose of a robot on the map, and the time since when it is known."""

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from operator import itemgetter

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import LOST, MeasuredPose
from vrg.bus.topics import Keys
from vrg.errors import StaleDataError
from vrg.geometry import compose, inverse
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.types import LEVEL, Pose, Uncertainty

TOO_OLD = 0.5
"""The age in s above which a measurement is no longer sent to the world, so that everybody sees that it is old."""

ODOMETRY, FEED, FUSION = "odometry", "feed", "fusion"
"""The ways to locate a robot: by what it measures itself; by what another program publishes, such as a motion-capture
system; and by the fusion centre, which has odometry and fixes. Its node and its process have the name FUSION, too."""
_WAYS = 50
"""The number of poses by odometry that are kept, 5 s of them."""


@dataclass(frozen=True, slots=True)
class StampedPose:
    """The pose of a robot at match time `stamp`, `age` s ago.

    Args:
        publish: True if the device must publish this pose to the world.
        uncertainty: how well it is known; None if that is not known.
    """

    pose: Pose
    stamp: float
    age: float
    publish: bool
    uncertainty: Uncertainty | None = None


class Location:
    """Finds where one robot is on the map.

    With odometry it begins at the pose in the match file. A player that was restarted does not know how far its robot
    has come, so it continues from the pose where the world last saw the robot. If a person has put the robot somewhere
    else, and an official has reported it, it continues from there.

    With fusion the centre publishes where the robot was a moment ago, and the odometry since then brings it up to now.

    Args:
        start: the pose of the robot when the match begins, in the map's frame.
        localisation: ODOMETRY, FEED or FUSION.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, name: str, start: Pose, localisation: str) -> None:
        self._name = name
        self._mailbox = mailbox
        self.topic = keys.robot_pose(name)
        self.motion_topic = keys.motion(name)
        self.fused = localisation == FUSION
        self._ways: deque[tuple[float, Pose]] = deque(maxlen=_WAYS)
        """The last poses by odometry alone, with their stamps, s."""
        self._feed = None if localisation == ODOMETRY else mailbox.subscribe(self.topic)
        self._world = mailbox.subscribe(keys.robot_seen(name))
        self._placed = mailbox.subscribe(keys.placed(name))
        self._known = start
        """The pose that the robot is taken to have at the next reading of its odometry, if `_begin_anew` is set."""
        self._begin_anew = True
        self._origin = start
        """The pose on the map of the odometry's own (0, 0, 0)."""
        self._located = False

    def hear(self) -> None:
        """Take in where the world last saw the robot, and where a person has put it."""
        seen = self._world.latest
        if not self._located and seen is not None:
            self._known, self._begin_anew, self._located = seen.body.pose, True, True
        for placed in self._placed.take():
            self._known, self._begin_anew, self._located = placed.body.pose, True, True

    def locate(self, odometry: Sample[Odometry] | None) -> StampedPose:
        """The pose of the robot according to the fusion centre, to the feed, or to its odometry.

        Raises:
            StaleDataError: the one that is used has not reported yet, or the robot is lost.
        """
        fed = None if self._feed is None else self._feed.latest
        if self._feed is not None and not self.fused:
            if fed is None:
                raise StaleDataError(f"expected its pose on {self.topic.key}, but none was received yet", self._name)
            return StampedPose(fed.body.pose, fed.stamp, abs(self._mailbox.now - fed.stamp), publish=False)
        if odometry is None:
            raise StaleDataError("expected its odometry, but none was received yet", self._name)
        if self.fused:
            return self._fused(odometry, fed)
        if self._begin_anew:
            self._begin_anew = False
            self._origin = compose(self._known, inverse(odometry.value.pose))
        pose = _as_high(compose(self._origin, odometry.value.pose), odometry.value.pose)
        return self._place(pose, odometry.stamp, odometry.age)

    def _fused(self, odometry: Sample[Odometry], found: Received[MeasuredPose] | None) -> StampedPose:
        pose, stamp = odometry.value.pose, odometry.stamp
        if not self._ways or stamp > self._ways[-1][0]:
            self._ways.append((stamp, pose))
        if found is None:
            raise StaleDataError("expected its place from the fusion centre, but none was received yet", self._name)
        unseen = found.body.unseen + max(0.0, stamp - found.stamp)
        if unseen > LOST:
            since = "yet" if unseen > stamp else f"for {unseen:.1f} s"
            raise StaleDataError(f"it is lost: no source has seen it {since}", self._name)
        then = self._ways[min(bisect_left(self._ways, found.stamp, key=itemgetter(0)), len(self._ways) - 1)][1]
        there = _as_high(compose(found.body.pose, compose(inverse(then), pose)), pose)
        return StampedPose(there, stamp, odometry.age, publish=False, uncertainty=found.body.uncertainty)

    def measured(self, ins: Sample[Ins]) -> StampedPose:
        """The pose of the robot according to its own inertial navigation system, which measures its pose on the map."""
        self._located = True
        return self._place(ins.value.pose, ins.stamp, ins.age)

    def _place(self, pose: Pose, stamp: float, age: float) -> StampedPose:
        publish = self._feed is None and self._located and age <= TOO_OLD
        return StampedPose(pose, max(0.0, stamp), age, publish=publish)


def _as_high(pose: Pose, odometry: Pose) -> Pose:
    """A pose with the height by odometry, which counts from the ground: nothing else measures it."""
    return pose if pose.z == odometry.z else Pose(pose.x, pose.y, pose.theta, odometry.z or LEVEL)
