"""The node that receives the vision of the Small Size League."""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any, Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Fix
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.errors import MessageError
from vrg.geometry import compose
from vrg.localisation.clock import ClockOffset
from vrg.localisation.source import RealSource, SourceContext
from vrg.localisation.ssl.network import Packet, Receiver
from vrg.localisation.ssl.packets import Seen, read_tracker, read_vision
from vrg.localisation.ssl.settings import SslSettings
from vrg.types import Pose

_SILENCE: Final = 3.0
"""The time in s without a packet after which that is told."""
_OTHER: Final = 2.0
"""The time in s for which a camera must be silent before one of the same number of another sender is listened to."""
_CAMERAS: Final = 64
"""The most cameras that are listened to at a time."""


class SslSource(RealSource):
    """Sees what SSL-Vision, or a tracker, publishes.

    Args:
        context: what it is made from. mailbox: its mailbox. keys: the keys of the match.
        monotonic: the clock by which packets are stamped, s. Nodes read no clock, so it is given from outside.
    """

    settings = SslSettings

    def __init__(
        self, context: SourceContext, mailbox: Mailbox, keys: Keys, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(context, mailbox, keys, monotonic)
        assert isinstance(context.settings, SslSettings)
        self._settings = settings = context.settings
        self._receiver = Receiver(settings.address, settings.port, settings.interface, monotonic)
        self._robots = {robot: name for name, robot in settings.robots.items() if name in context.robots}
        self._without = sorted(set(context.robots) - set(settings.robots))
        self._field = settings.field.pose
        self._cameras: dict[int, tuple[str, float]] = {}
        """The sender of each camera, and when that was heard last, monotonic, s."""
        self._refused: dict[str, float] = {}
        """The senders of another field, and when each had a camera that another one has, monotonic, s."""
        self._clocks: dict[str, ClockOffset] = {}
        """The clock of each sender by this process's."""
        self._heard: float | None = None
        """The time at which a packet came last, or it began to listen, monotonic, s."""
        self._counts: Counter[str] = Counter()
        self._unknown: Counter[str] = Counter()

    def start(self) -> None:
        """Begin to receive."""
        if self._without:
            self.warn("without", "no robot of the league is named for %s", ", ".join(self._without))
        self._receiver.start()

    def stop(self) -> None:
        """Receive no more."""
        self._receiver.close()

    def seen(self, tick: Tick) -> Iterable[tuple[float, tuple[Fix, ...]]]:
        """The robots in the packets since the last tick."""
        found, packets, now = [], self._receiver.take(), self._monotonic()
        if packets or self._heard is None:
            self._heard = now
        silence = now - self._heard
        self.tell(self._nothing(silence) if silence > _SILENCE else None)
        for packet in packets:
            seen = self._read(packet)
            if seen is None or not self._listens_to(packet, seen):
                continue
            if (time := self._time(packet, seen)) is not None and (fixes := self._fixes(seen)):
                found.append((time, fixes))
        return found

    def counted(self) -> dict[str, Any]:
        """The packets that were used and refused, and the robots that no player has."""
        return {"packets": dict(self._counts), "unknown": dict(self._unknown)}

    def _nothing(self, silence: float) -> str:
        """That nothing was received for some time, s, in words."""
        where = f"{self._settings.address}:{self._settings.port}"
        advice = "does vision run, and is `interface` of its network?"
        return f"nothing was received at {where} for {silence:.0f} s: {advice}"

    def _read(self, packet: Packet) -> Seen | None:
        read = read_vision if self._settings.packets == "vision" else read_tracker
        try:
            return read(packet.data)
        except MessageError as error:
            self._refuse("malformed", "a packet of %s is ignored: %s", packet.sender, error)
            return None

    def _listens_to(self, packet: Packet, seen: Seen) -> bool:
        """Return whether a packet counts: those of all senders do but of one that has a camera that another one has."""
        holder, heard = self._cameras.get(seen.camera, (packet.sender, packet.arrived))
        if holder != packet.sender and packet.arrived - heard < _OTHER:
            self._refused = {s: at for s, at in self._refused.items() if packet.arrived - at < _OTHER}
            self._refused[packet.sender] = packet.arrived
            self._cameras = {n: (s, at) for n, (s, at) in self._cameras.items() if s != packet.sender}
            text = "%s has a camera %d, too, and is ignored, as %s has it. Is there another field?"
            self._refuse("other sender", text, packet.sender, seen.camera, holder)
            return False
        if packet.arrived - self._refused.get(packet.sender, -math.inf) < _OTHER:
            self._counts["other sender"] += 1
            return False
        if seen.camera not in self._cameras or holder != packet.sender:
            current = {n: (s, at) for n, (s, at) in self._cameras.items() if packet.arrived - at < _OTHER}
            if len(current) >= _CAMERAS:
                self._refuse("too many", "more than %d cameras: that of %s is ignored", _CAMERAS, packet.sender)
                return False
            self._cameras = current
            senders = {packet.sender, *(sender for sender, _ in current.values())}
            self._clocks = {sender: self._clocks.get(sender, ClockOffset()) for sender in senders}
        self._cameras[seen.camera] = packet.sender, packet.arrived
        self._clocks[packet.sender].heard(seen.sent, packet.arrived)
        self._counts["used"] += 1
        return True

    def _time(self, packet: Packet, seen: Seen) -> float | None:
        """The match time at which a picture was taken, s; None before the match clock was heard."""
        ahead = self._clocks[packet.sender].match_time(0.0)
        late = self._settings.latency if self._settings.packets == "tracker" else 0.0
        return None if ahead is None else self.match_time(seen.captured - ahead - late)

    def _fixes(self, seen: Seen) -> tuple[Fix, ...]:
        settings, fixes = self._settings, dict[str, Fix]()
        for robot in seen.robots:
            name = self._robots.get(f"{robot.colour} {robot.number}")
            if name is None:
                self._unknown[f"{robot.colour} {robot.number}"] += 1
            elif robot.confidence >= settings.confidence:
                pose = compose(self._field, Pose(robot.x, robot.y, robot.heading or 0.0))
                heading = None if robot.heading is None else math.radians(settings.heading)
                fixes[name] = Fix(name, pose, settings.position, heading)
        return tuple(fixes.values())

    def _refuse(self, what: str, text: str, *values: object) -> None:
        """Count what is refused, and log it the first time."""
        self._counts[what] += 1
        self.warn(what, text, *values)
