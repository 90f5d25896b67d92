"""Where a physical robot is on the map, and since when that is known."""

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
"""s after which a measurement is not told to the world any more, so that everybody sees its age."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a robot was at match time `stamp`, `age` s ago.

    Args:
        publish: the world is to be told of it by this side.
    """

    pose: Pose
    stamp: float
    age: float
    publish: bool


class Location:
    """One robot's.

    By odometry it begins where the match file says. A player that was restarted has forgotten how far its robot has
    come: it goes on from where the world saw the robot last. Where a person has put the robot elsewhere, and has said
    so, it goes on from there.

    Args:
        start: where the robot stands when the match begins.
        fed: somebody else publishes its pose.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, name: str, start: Pose, *, fed: bool) -> None:
        self._name = name
        self._mailbox = mailbox
        self.topic = keys.robot_pose(name)
        self._feed = mailbox.subscribe(self.topic) if fed else None
        self._world = mailbox.subscribe(keys.poses)
        self._placed = mailbox.subscribe(keys.placed(name))
        self._known = start
        """Where the robot is taken to be at the next reading of its odometry, if that reading begins anew."""
        self._begin_anew = True
        self._origin = start
        """Where the odometry's own (0, 0, 0) is on the map."""
        self._located = False

    def hear(self) -> None:
        """Take in where the world last saw the robot, and where a person has put it."""
        poses = self._world.latest
        if not self._located and poses is not None:
            for body in poses.body.bodies:
                if body.name == self._name:
                    self._known, self._begin_anew, self._located = body.pose, True, True
        for placed in self._placed.take():
            self._known, self._begin_anew, self._located = placed.body.pose, True, True

    def locate(self, odometry: Sample[Odometry] | None) -> Place:
        """Where the robot is, by the feed or by its odometry.

        Raises:
            StaleDataError: neither has told.
        """
        now = self._mailbox.now
        if self._feed is not None:
            fed = self._feed.latest
            if fed is None:
                raise StaleDataError(f"{self._name}: expected its pose on {self.topic.key}, but none has come yet")
            return Place(fed.body.pose, fed.stamp, abs(now - fed.stamp), publish=False)
        if odometry is None:
            raise StaleDataError(f"{self._name}: expected its odometry, but none has come yet")
        if self._begin_anew:
            self._begin_anew = False
            self._origin = compose(self._known, inverse(odometry.value.pose))
        pose = compose(self._origin, odometry.value.pose)
        return self._place(pose, odometry.stamp, odometry.age)

    def measured(self, ins: Sample[Ins]) -> Place:
        """Where a robot is that measures its own pose on the map."""
        self._located = True
        return self._place(ins.value.pose, ins.stamp, ins.age)

    def _place(self, pose: Pose, stamp: float, age: float) -> Place:
        return Place(pose, max(0.0, stamp), age, publish=self._located and age <= TOO_OLD)
