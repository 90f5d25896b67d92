"""The node of a motion capture system."""

import math
import time
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from typing import Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.topics import Keys
from vrg.errors import ConfigError
from vrg.localisation.mocap.frames import Frame, Request
from vrg.localisation.mocap.settings import MocapSettings
from vrg.localisation.mocap.stream import FrameStream
from vrg.localisation.mocap.tracking import TIPPED, Fault, Tracking
from vrg.localisation.source import RealSource, SourceContext
from vrg.types import Pose

# It is loaded by another process; that it is missing is said before a match begins.
if find_spec("motioncapture") is None:
    raise ConfigError(
        "expected the package motioncapture for a motion capture system, found none: install it by "
        "`.venv/bin/pip install -e '.[mocap]'` in the folder of VRG"
    )

_PATIENCE: Final = 2.0
"""The time in s for which nothing may come from a system before it is connected again."""
_WARNINGS: Final = {
    Fault.FROZEN: "the rigid body %s of %s does not change at all: its system has lost it, or hangs",
    Fault.TIPPED: "the rigid body %s of %s is tilted by more than "
    + f"{math.degrees(TIPPED):.0f} degrees: has the robot tipped over, or is `up` wrong?",
}


class MocapSource(RealSource[Frame]):
    """Sees the rigid bodies that a motion capture system tracks.

    Args:
        context: what it is made from. mailbox: its mailbox. keys: the keys of the match.
        monotonic: the clock by which frames are stamped, s. Nodes read no clock, so it is given from outside.

    Raises:
        ConfigError: two robots have the same rigid body.
    """

    settings = MocapSettings
    mark, items = "rigid body", "frames"

    def __init__(
        self, context: SourceContext, mailbox: Mailbox, keys: Keys, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        assert isinstance(context.settings, MocapSettings)
        self._settings = settings = context.settings
        robots = dict[str, str]()
        for robot in context.robots:
            body = settings.body_of(robot)
            if (other := robots.setdefault(body, robot)) != robot:
                raise ConfigError(f"expected a rigid body for each robot, got {body} for {other} and for {robot}")
        stream = FrameStream(Request(settings.system, settings.options(), settings.rate, _PATIENCE), monotonic)
        marks = {settings.body_of(robot): robot for robot in settings.bodies} | robots
        super().__init__(context, mailbox, keys, stream, marks, monotonic)
        offsets = {robot: body.pose for robot, body in settings.bodies.items()}
        self._tracking = Tracking(robots, offsets, settings.up, settings.origin.pose)

    def captured(self) -> Iterable[tuple[float, Frame]]:
        """The frames since the last call."""
        return [(frame.time - self._settings.latency, frame) for frame in self._stream.take()]

    def fixes_of(self, frame: Frame) -> Iterable[Fix]:
        """The robots in a frame."""
        settings = self._settings
        for one in self._tracking.take(frame):
            if one.robot is None:
                self.count_unknown(one.body)
            elif isinstance(one.found, Pose):
                yield Fix(one.robot, one.found, settings.position, math.radians(settings.heading))
            else:
                self.ignore(one.found, one.body, _WARNINGS.get(one.found), one.body, one.robot)
