"""The settings and the node of the vision of the Small Size League as a source of fixes."""

import ipaddress
import math
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final, Literal

from pydantic import Field, field_validator

from vrg.bus.clock_tracker import ClockOffset
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.topics import Keys
from vrg.errors import ConfigError, MessageError
from vrg.geometry import compose, inverse
from vrg.localisation.source import SourceContext
from vrg.tables import Table
from vrg.types import Pose
from vrg_locate.source import PoseTable, RealSource
from vrg_locate.ssl.ball import likely_ball
from vrg_locate.ssl.network import Packet, PacketStream
from vrg_locate.ssl.packets import Seen, SeenBall, read_tracker, read_vision

_OTHER: Final = 2.0
"""The time in s for which a camera must be silent before one of the same number of another sender is listened to."""
_BALL: Final = "ball"
"""What stands for the ball among the marks of robots."""
_CAMERAS: Final = 64
"""The most cameras that are listened to at a time."""


class SslSettings(Table):
    """The table of a source of the kind `ssl`.

    Args:
        robots: the robot of the league by the player's name, such as `yellow 3`.
        ball: the body of the match that is the league's ball; if missing, balls are ignored.
        address, port: where the packets are sent. interface: the address of this machine's network interface.
        packets: `vision` for those of SSL-Vision, `tracker` for those of a tracker.
        field: the middle of the league's field on the map, and the direction of its x axis.
        position: the standard deviation of x and of y, m. heading: that of the heading, degrees.
        confidence: robots and balls of which the sender is less sure are ignored, 0 to 1.
        latency: the time from a picture to a packet of a tracker, which does not tell it, s.
    """

    robots: dict[str, str] = Field(default_factory=dict)
    ball: str | None = None
    address: str = "224.5.23.2"
    port: int = Field(10006, ge=1, le=65535)
    interface: str = ""
    packets: Literal["vision", "tracker"] = "vision"
    field: PoseTable = Field(default_factory=lambda: PoseTable.model_validate({}))
    position: float = Field(0.01, gt=0.0, le=10.0)
    heading: float = Field(1.0, gt=0.0, le=90.0)
    confidence: float = Field(0.5, ge=0.0, le=1.0)
    latency: float = Field(0.0, ge=0.0, le=0.5)

    @field_validator("robots")
    @classmethod
    def _named(cls, value: dict[str, str]) -> dict[str, str]:
        for name, robot in value.items():
            if not re.fullmatch(r"(yellow|blue) \d{1,2}", robot):
                raise ValueError(f"{name}: expected a robot of the league, such as `yellow 3`, got {robot!r}")
        if len(set(value.values())) < len(value):
            raise ValueError("expected another robot of the league for each player")
        return value

    @field_validator("address", "interface")
    @classmethod
    def _address(cls, value: str) -> str:
        if value:
            ipaddress.IPv4Address(value)
        return value


class SslSource(RealSource[Seen]):
    """Sees what SSL-Vision, or a tracker, publishes.

    Args:
        context: what it is made from. mailbox: its mailbox. keys: the keys of the match.
        monotonic: the clock by which packets are stamped, s. Nodes read no clock, so it is given from outside.

    Raises:
        ConfigError: the ball is no disc.
    """

    settings = SslSettings
    mark, items = "robot or ball of the league", "packets"

    def __init__(
        self, context: SourceContext, mailbox: Mailbox, keys: Keys, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        assert isinstance(context.settings, SslSettings)
        self._settings = settings = context.settings
        stream = PacketStream(settings.address, settings.port, settings.interface, monotonic)
        marks = {robot: name for name, robot in settings.robots.items()}
        marks |= {} if settings.ball is None else {_BALL: settings.ball}
        body = context.things.get(settings.ball or "")
        if body is not None and not body.radius:
            raise ConfigError(f"{context.name}: ball: expected a body with a radius, got {settings.ball}")
        super().__init__(context, mailbox, keys, stream, marks, monotonic)
        self._field = settings.field.pose
        at = compose(inverse(self._field), Pose(0.0, 0.0, 0.0) if body is None else body.pose)
        self._last: tuple[float, SeenBall, Sequence[SeenBall]] = (-math.inf, SeenBall(at.x, at.y), ())
        """When the ball was seen last, monotonic, s, where on the league's field, and which others then. At first it is
        taken to be where the match file has it."""
        self._cameras: dict[int, tuple[str, float]] = {}
        """The sender of each camera, and when that was heard last, monotonic, s."""
        self._refused: dict[str, float] = {}
        """The senders of another field, and when each had a camera that another one has, monotonic, s."""
        self._clocks: dict[str, ClockOffset] = {}
        """The clock of each sender by this process's."""

    def captured(self) -> Iterable[tuple[float, Seen]]:
        """The pictures in the packets since the last call that count."""
        for packet in self._stream.take():
            seen = self._read(packet)
            if seen is None or not self._listens_to(packet, seen):
                continue
            if (ahead := self._clocks[packet.sender].match_time(0.0)) is not None:
                late = self._settings.latency if self._settings.packets == "tracker" else 0.0
                captured = seen.captured - ahead - late
                yield captured, replace(seen, captured=captured)

    def fixes_of(self, seen: Seen) -> Iterable[Fix]:
        """The robots in a picture, and the ball."""
        settings, fixes = self._settings, dict[str, Fix]()
        for robot in seen.robots:
            name = self._robots.get(f"{robot.colour} {robot.number}")
            if name is None:
                self._unknown[f"{robot.colour} {robot.number}"] += 1
            elif robot.confidence >= settings.confidence:
                pose = compose(self._field, Pose(robot.x, robot.y, robot.heading or 0.0))
                heading = None if robot.heading is None else math.radians(settings.heading)
                fixes[name] = Fix(name, pose, settings.position, heading)
        if (name := self._robots.get(_BALL)) is not None:
            then, last, others = self._last
            sure = [ball for ball in seen.balls if ball.confidence >= settings.confidence]
            if (found := likely_ball(sure, last, seen.captured - then, others)) is not None:
                self._last = max(then, seen.captured), found, [ball for ball in sure if ball is not found]
                fixes[name] = Fix(name, compose(self._field, Pose(found.x, found.y, 0.0)), settings.position)
        return fixes.values()

    def _read(self, packet: Packet) -> Seen | None:
        read = read_vision if self._settings.packets == "vision" else read_tracker
        try:
            return read(packet.data)
        except MessageError as error:
            self.ignore("malformed", None, "a packet of %s is ignored: %s", packet.sender, error)
            return None

    def _listens_to(self, packet: Packet, seen: Seen) -> bool:
        """Return whether a packet counts: those of all senders do but of one that has a camera that another one has."""
        holder, heard = self._cameras.get(seen.camera, (packet.sender, packet.arrived))
        if holder != packet.sender and packet.arrived - heard < _OTHER:
            self._refused = {s: at for s, at in self._refused.items() if packet.arrived - at < _OTHER}
            self._refused[packet.sender] = packet.arrived
            self._cameras = {n: (s, at) for n, (s, at) in self._cameras.items() if s != packet.sender}
            text = "%s has a camera %d, too, and is ignored, as %s has it. Is there another field?"
            self.ignore("other sender", None, text, packet.sender, seen.camera, holder)
            return False
        if packet.arrived - self._refused.get(packet.sender, -math.inf) < _OTHER:
            self.ignore("other sender", None, None)
            return False
        if seen.camera not in self._cameras or holder != packet.sender:
            current = {n: (s, at) for n, (s, at) in self._cameras.items() if packet.arrived - at < _OTHER}
            if len(current) >= _CAMERAS:
                self.ignore("too many", None, "more than %d cameras: that of %s is ignored", _CAMERAS, packet.sender)
                return False
            self._cameras = current
            senders = {packet.sender, *(sender for sender, _ in current.values())}
            self._clocks = {sender: self._clocks.get(sender, ClockOffset()) for sender in senders}
        self._cameras[seen.camera] = packet.sender, packet.arrived
        self._clocks[packet.sender].heard(seen.sent, packet.arrived)
        return True
