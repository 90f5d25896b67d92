"""The pose of a physical robot on the map, and the time since when it is known."""

from dataclasses import dataclass

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.errors import StaleDataError
from vrg.geometry import compose, inverse
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import Sample
from vrg.types import Pose

TOO_OLD = 0.5
"""The age in s above which a measurement is no longer sent to the world, so that everybody sees that it is old."""


@dataclass(frozen=True, slots=True)
class StampedPose:
    """The pose of a robot at match time `stamp`, `age` s ago.

    Args:
        publish: True if the device must publish this pose to the world.
    """

    pose: Pose
    stamp: float
    age: float
    publish: bool


class Location:
    """Finds where one physical robot is on the map.

    With odometry it begins at the pose in the match file. A player that was restarted does not know how far its robot
    has come, so it goes on from the pose where the world last saw the robot. If a person has put the robot somewhere
    else, and an official has reported it, it goes on from there.

    Args:
        start: the pose of the robot when the match begins, in the map's frame.
        fed: True if another program publishes the robot's pose.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, name: str, start: Pose, *, fed: bool) -> None:
        self._name = name
        self._mailbox = mailbox
        self.topic = keys.robot_pose(name)
        self._feed = mailbox.subscribe(self.topic) if fed else None
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
        """The pose of the robot according to the feed, or to its odometry if there is no feed.

        Raises:
            StaleDataError: the one that is used has not reported yet.
        """
        now = self._mailbox.now
        if self._feed is not None:
            fed = self._feed.latest
            if fed is None:
                raise StaleDataError(f"{self._name}: expected its pose on {self.topic.key}, but none has come yet")
            return StampedPose(fed.body.pose, fed.stamp, abs(now - fed.stamp), publish=False)
        if odometry is None:
            raise StaleDataError(f"{self._name}: expected its odometry, but none has come yet")
        if self._begin_anew:
            self._begin_anew = False
            self._origin = compose(self._known, inverse(odometry.value.pose))
        pose = compose(self._origin, odometry.value.pose)
        return self._place(pose, odometry.stamp, odometry.age)

    def measured(self, ins: Sample[Ins]) -> StampedPose:
        """The pose of the robot according to its own inertial navigation system, which measures its pose on the map."""
        self._located = True
        return self._place(ins.value.pose, ins.stamp, ins.age)

    def _place(self, pose: Pose, stamp: float, age: float) -> StampedPose:
        publish = self._feed is None and self._located and age <= TOO_OLD
        return StampedPose(pose, max(0.0, stamp), age, publish=publish)
