"""The node of a motion capture system."""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from typing import Any, Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.errors import ConfigError
from vrg.localisation.mocap.frames import Frame, Request
from vrg.localisation.mocap.settings import MocapSettings
from vrg.localisation.mocap.stream import Stream
from vrg.localisation.mocap.tracking import TIPPED, Fault, Tracking
from vrg.localisation.source import RealSource, SourceContext
from vrg.types import Pose

# It is loaded by another process; that it is missing is said before a match begins.
if find_spec("motioncapture") is None:
    raise ConfigError(
        "expected the package motioncapture for a motion capture system, found none: install it by "
        "`.venv/bin/pip install -e '.[mocap]'` in the folder of VRG"
    )

_OLD: Final = 1.0
"""The age in s from which on a frame says nothing any more, as when the match clock has stood still."""
_PATIENCE: Final = 2.0
"""The time in s for which nothing may come from a system before it is connected again."""
_WARNINGS: Final = {
    Fault.FROZEN: "the rigid body %s of %s does not change at all: its system has lost it, or hangs",
    Fault.TIPPED: "the rigid body %s of %s is tilted by more than "
    + f"{math.degrees(TIPPED):.0f} degrees: has the robot tipped over, or is `up` wrong?",
}


class MocapSource(RealSource):
    """Sees the rigid bodies that a motion capture system tracks.

    Args:
        context: what it is made from. mailbox: its mailbox. keys: the keys of the match.
        monotonic: the clock by which frames are stamped, s. Nodes read no clock, so it is given from outside.

    Raises:
        ConfigError: two robots have the same rigid body.
    """

    settings = MocapSettings

    def __init__(
        self, context: SourceContext, mailbox: Mailbox, keys: Keys, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(context, mailbox, keys, monotonic)
        assert isinstance(context.settings, MocapSettings)
        self._settings = settings = context.settings
        robots = dict[str, str]()
        for robot in context.robots:
            body = settings.body_of(robot)
            if (other := robots.setdefault(body, robot)) != robot:
                raise ConfigError(f"expected a rigid body for each robot, got {body} for {other} and for {robot}")
        self._strangers = sorted(set(settings.bodies) - set(context.robots))
        self._elsewhere = {settings.body_of(robot) for robot in self._strangers}
        offsets = {robot: body.pose for robot, body in settings.bodies.items()}
        self._tracking = Tracking(robots, offsets, settings.up, settings.origin.pose)
        self._stream = Stream(Request(settings.system, settings.options(), settings.rate, _PATIENCE), monotonic)
        self._expected = ", ".join(sorted(robots))
        self._fixes: Counter[str] = Counter()
        self._unknown: Counter[str] = Counter()
        self._ignored: Counter[Fault] = Counter()
        self._frames = 0

    def start(self) -> None:
        """Begin to listen."""
        if self._strangers:
            self.warn("strangers", "no robot that is located here has the name %s", ", ".join(self._strangers))
        self._stream.start()

    def stop(self) -> None:
        """Listen no more."""
        self._stream.close()

    def seen(self, tick: Tick) -> Iterable[tuple[float, tuple[Fix, ...]]]:
        """The robots in the frames since the last tick."""
        self.tell(self._stream.problem())
        found, now = [], self._monotonic()
        for frame in self._stream.take():
            stamp = self.match_time(frame.time - self._settings.latency)
            if stamp is not None and now - frame.time <= _OLD:
                self._frames += 1
                if fixes := self._fixes_of(frame):
                    found.append((stamp, fixes))
        return found

    def counted(self) -> dict[str, Any]:
        """The frames that were used, the fixes of each robot, and the rigid bodies that were of no use."""
        return {
            "frames": self._frames,
            "fixes": dict(self._fixes),
            "unknown": dict(sorted(self._unknown.items())),
            "ignored": {str(fault): count for fault, count in self._ignored.items()},
        }

    def _fixes_of(self, frame: Frame) -> tuple[Fix, ...]:
        settings, fixes = self._settings, []
        for one in self._tracking.take(frame):
            if one.robot is None:
                self._count_unknown(one.body)
            elif isinstance(one.found, Pose):
                self._fixes[one.robot] += 1
                fixes.append(Fix(one.robot, one.found, settings.position, math.radians(settings.heading)))
            else:
                self._ignored[one.found] += 1
                if one.found in _WARNINGS:
                    self.warn((one.found, one.body), _WARNINGS[one.found], one.body, one.robot)
        return tuple(fixes)

    def _count_unknown(self, body: str) -> None:
        if body not in self._elsewhere:
            self._unknown[body] += 1
            text = "the rigid body %s is seen, which no robot has; robots have %s"
            self.warn(("unknown", body), text, body or "without a name", self._expected)
