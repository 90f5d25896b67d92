"""The settings and the node of a motion capture system."""

import ipaddress
import math
import time
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from typing import Annotated, Any, Final, Literal

from pydantic import Field, field_validator, model_validator

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.topics import Keys
from vrg.errors import ConfigError
from vrg.localisation.source import SourceContext
from vrg.tables import Table
from vrg.types import Pose
from vrg_locate.mocap.frames import MocapFrame, Request
from vrg_locate.mocap.stream import FrameStream
from vrg_locate.mocap.tracking import TIPPED, Fault, Tracking
from vrg_locate.source import PoseTable, RealSource

# It is loaded by another process; that it is missing is said before a match begins.
if find_spec("motioncapture") is None:
    raise ConfigError(
        "expected the package motioncapture for a motion capture system, found none: install it by "
        "`pip install 'virtual-robotic-games-locate[mocap]'`"
    )

_PATIENCE: Final = 2.0
"""The time in s for which nothing may come from a system before it is connected again."""
_WARNINGS: Final = {
    Fault.FROZEN: "the rigid body %s of %s does not change at all: its system has lost it, or hangs",
    Fault.TIPPED: "the rigid body %s of %s is tilted by more than "
    + f"{math.degrees(TIPPED):.0f} degrees: has the robot tipped over, or is `up` wrong?",
}


OPTIONS: Final[dict[str, dict[str, str]]] = {
    "optitrack": {"port": "port_command", "interface": "interface_ip"},
    "vicon": {},
    "qualisys": {"port": "port"},
    "vrpn": {},
}
"""The library's names of the settings that only some systems have. The others take a port as a part of the host."""


class BodyTable(PoseTable):
    """The rigid body of a robot: x ahead of the robot's centre and y to its left, m, and its heading there, degrees.

    Args:
        name: in the capture system; that of the robot if missing.
    """

    name: str | None = None


class MocapSettings(Table):
    """The table of a source of the kind `mocap`.

    Systems measure to a millimetre, but the default of `position` is what the time costs, which is known to about 7 ms:
    a robot drives 5 mm meanwhile at 0.7 m/s.

    Args:
        system: which one. host: the name or the address of the computer on which it runs.
        port: where it takes requests; the system's own if missing. interface: the address of this machine's network
            interface, on which OptiTrack's multicast packets arrive.
        up: its axis that points up.
        origin: the pose of its frame on the map: where its origin is and where its x axis points.
        bodies: the rigid bodies by the names of robots and things. One that is not named has that of its own name.
        rate: the most measurements of each body in a second that are used.
        latency: the time from the exposure to the arrival of a frame, s.
        position: the standard deviation of x and of y, m. heading: that of the heading, degrees.
    """

    system: Literal["optitrack", "vicon", "qualisys", "vrpn"]
    host: Annotated[str, Field(min_length=1)]
    port: Annotated[int, Field(ge=1, le=65535)] | None = None
    interface: str | None = None
    up: Literal["y", "z"] = "z"
    origin: PoseTable = Field(default_factory=lambda: PoseTable.model_validate({}))
    bodies: dict[str, BodyTable] = Field(default_factory=dict)
    rate: Annotated[float, Field(gt=0.0, le=500.0)] = 50.0
    latency: Annotated[float, Field(ge=0.0, le=0.5)] = 0.01
    position: Annotated[float, Field(gt=0.0, le=10.0)] = 0.005
    heading: Annotated[float, Field(gt=0.0, le=90.0)] = 0.5

    @field_validator("interface")
    @classmethod
    def _address(cls, value: str | None) -> str | None:
        if value is not None:
            ipaddress.IPv4Address(value)
        return value

    @model_validator(mode="after")
    def _possible(self) -> "MocapSettings":
        for name in ("port", "interface"):
            if getattr(self, name) is not None and name not in OPTIONS[self.system]:
                raise ValueError(f"{self.system} has no {name}: see the README of vrg-locate")
        owners: dict[str, str] = {}
        for robot in self.bodies:
            body = self.body_of(robot)
            if (other := owners.setdefault(body, robot)) != robot:
                raise ValueError(f"expected a rigid body for each robot, got {body} for {other} and for {robot}")
        return self

    def body_of(self, robot: str) -> str:
        """The name of a robot's rigid body."""
        table = self.bodies.get(robot)
        return table.name if table is not None and table.name is not None else robot

    def options(self) -> dict[str, str]:
        """The settings in the words of the library."""
        given: dict[str, Any] = {"port": self.port, "interface": self.interface}
        named = {word: str(given[name]) for name, word in OPTIONS[self.system].items() if given[name] is not None}
        return {"hostname": self.host, **named}


class MocapSource(RealSource[MocapFrame]):
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
        for robot in (*context.robots, *context.things):
            body = settings.body_of(robot)
            if (other := robots.setdefault(body, robot)) != robot:
                raise ConfigError(f"expected a rigid body for each robot, got {body} for {other} and for {robot}")
        stream = FrameStream(Request(settings.system, settings.options(), settings.rate, _PATIENCE), monotonic)
        marks = {settings.body_of(robot): robot for robot in settings.bodies} | robots
        super().__init__(context, mailbox, keys, stream, marks, monotonic)
        offsets = {robot: body.pose for robot, body in settings.bodies.items()}
        self._tracking = Tracking(robots, offsets, settings.up, settings.origin.pose)

    def captured(self) -> Iterable[tuple[float, MocapFrame]]:
        """The frames since the last call."""
        return [(frame.time - self._settings.latency, frame) for frame in self._stream.take()]

    def fixes_of(self, frame: MocapFrame) -> Iterable[Fix]:
        """The robots in a frame."""
        settings = self._settings
        for one in self._tracking.take(frame):
            if one.robot is None:
                self.count_unknown(one.body)
            elif isinstance(one.found, Pose):
                yield Fix(one.robot, one.found, settings.position, math.radians(settings.heading))
            else:
                self.ignore(one.found, one.body, _WARNINGS.get(one.found), one.body, one.robot)
