"""CAN buses in memory, with emulated drives, on simulated time: as `vrg.hal.can.bus` and `run_drives`, but no threads.

Every frame takes as long as the longest classic one. All others on the bus hear it then, in the order of sending.
"""

import logging
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Final, TypeVar

from msgspec.structs import replace

from vrg.errors import RobotError
from vrg.hal.can.frame import Filter, Frame
from vrg.hal.can.link import IDLE_TIMEOUT, SEND_TIMEOUT, Link
from vrg.hal.can.sending import FRAME_BITS
from vrg.hal.can.workshop.emulated import EmulatedDrive
from vrg.hal.can.workshop.faults import FaultRequest, encode_fault
from vrg.hal.simulated_clock import SimulatedClock

log = logging.getLogger(__name__)

T = TypeVar("T")

BITRATE: Final = 1_000_000
"""bit/s of a bus whose bit rate is not written down: a virtual bus has none, and CAN has no higher one."""
_URGENT: Final = 4
"""The frames that switch motors off for which there is room where other frames are refused; see vrg.hal.can.sending."""

_STEP: Final = 1e-3
"""s between two steps of a drive whose next one is overdue, as it waits for something."""

Tamper = Callable[[Frame, bool], Sequence[tuple[float, Frame]]]
"""A function of a frame that is sent, by a drive or not. It returns the frames that come in its place, each with the s
that it is late."""


class Simulation:
    """Buses in memory. A `Medium`.

    Args:
        strict: an exception of a bus' callback ends the simulation. Otherwise it is trouble of the bus, as in a match
            of processes: the motors must stop, and the error must be seen.

    Attributes:
        clock: the time of all its buses.
    """

    def __init__(self, *, strict: bool = False) -> None:
        self.strict = strict
        self.clock = SimulatedClock()
        self._wires: dict[str, Wire] = {}

    def wire(self, link: Link) -> "Wire":
        """The bus that a link names."""
        wire = self._wires.get(str(link))
        if wire is None:
            wire = self._wires[str(link)] = Wire(self.clock, link)
        return wire

    def bus(
        self,
        link: Link,
        on_frame: Callable[[Frame], None],
        on_trouble: Callable[[str], None] = lambda _: None,
        on_quiet: Callable[[float], None] = lambda _: None,
    ) -> "Port":
        """Make a bus, which is not open yet; see `vrg.hal.can.bus.CanBus`."""
        return Port(self.wire(link), on_frame, on_trouble, on_quiet, strict=self.strict)


class Wire:
    """One bus, with all that is on it.

    Args:
        clock: its time. link: how it is named.

    Attributes:
        drives: those that are on it.
        tamper: None, or what becomes of each frame.
        trouble: what is wrong with the adapters of the ports, in words, while nothing passes them; None while nothing
            is.
        missing: why the bus cannot be opened, in words; None while it can be.
        stuck: why its controller cannot be brought back, in words; None while it can be.
    """

    def __init__(self, clock: SimulatedClock, link: Link) -> None:
        self.clock = clock
        self.link = link
        self.tamper: Tamper | None = None
        self.trouble: str | None = None
        self.missing: str | None = None
        self.stuck: str | None = None
        self._frame_time = FRAME_BITS / (link.bitrate or BITRATE)
        self._busy_until = 0.0
        self._ports: list[Port] = []
        self.drives: list[EmulatedDrive] = []
        self._due: dict[EmulatedDrive, float] = {}
        self._stepped: dict[EmulatedDrive, float] = {}

    def attach(self, drives: Iterable[EmulatedDrive]) -> None:
        """Put drives on the bus."""
        for drive in drives:
            self.drives.append(drive)
            self._schedule(drive)

    def detach(self, drives: Iterable[EmulatedDrive]) -> None:
        """Take drives off the bus."""
        for drive in drives:
            self.drives.remove(drive)
            self._due.pop(drive, None)
            self._stepped.pop(drive, None)

    def fault(self, drive: EmulatedDrive, request: FaultRequest) -> None:
        """Let something go wrong in a drive, even if frames on the bus are lost."""
        self._answer(drive, drive.receive(encode_fault(drive.node, request), self.clock.now()))

    def put(self, frame: Frame, sender: "Port | EmulatedDrive | None" = None, *, urgent: bool = False) -> bool:
        """Send a frame; False if there is no room for it."""
        now = self.clock.now()
        if self._busy_until - now > SEND_TIMEOUT + (_URGENT * self._frame_time if urgent else 0.0):
            return False
        through = self._busy_until = max(self._busy_until, now) + self._frame_time
        frames = [(0.0, frame)] if self.tamper is None else self.tamper(frame, isinstance(sender, EmulatedDrive))
        for late, one in frames:
            self.clock.at(through + late, lambda one=one: self._deliver(one, sender))  # type: ignore[misc]
        return True

    def _deliver(self, frame: Frame, sender: "Port | EmulatedDrive | None") -> None:
        now = self.clock.now()
        heard = replace(frame, at=now)
        if self.trouble is None:
            for port in tuple(self._ports):
                if port is not sender:
                    port.hear(heard)
        for drive in tuple(self.drives):
            if drive is not sender:
                self._answer(drive, drive.receive(heard, now))

    def _answer(self, drive: EmulatedDrive, frames: Sequence[Frame]) -> None:
        for frame in frames:
            self.put(frame, drive)
        self._schedule(drive)

    def _schedule(self, drive: EmulatedDrive) -> None:
        """Let a drive's next step happen when it is due, and no sooner than _STEP s from now if that has passed."""
        due = drive.due
        if due <= self.clock.now():
            due = max(due, self._stepped.get(drive, -math.inf) + _STEP)
        if due < math.inf and due != self._due.get(drive):
            self._due[drive] = due
            self.clock.at(due, lambda: self._step(drive, due))

    def _step(self, drive: EmulatedDrive, due: float) -> None:
        if drive in self.drives and self._due.get(drive) == due:
            del self._due[drive]
            self._stepped[drive] = self.clock.now()
            self._answer(drive, drive.step(self.clock.now()))


class Port:
    """An adapter on a bus. A `Bus`."""

    def __init__(
        self,
        wire: Wire,
        on_frame: Callable[[Frame], None],
        on_trouble: Callable[[str], None],
        on_quiet: Callable[[float], None],
        *,
        strict: bool,
    ) -> None:
        self.link = wire.link
        self._wire = wire
        self._on_frame = on_frame
        self._on_trouble = on_trouble
        self._on_quiet = on_quiet
        self._strict = strict
        self._fault_logged: str | None = None
        self._wanted: list[Filter] | None = None
        self._opened = 0
        self._open = False
        self._heard = 0.0
        self._frozen = False
        self._waiting: list[Frame] = []

    def start(self) -> None:
        """Open the bus and begin to listen. Idempotent.

        Raises:
            RobotError: it cannot be opened now.
        """
        if self._open:
            return
        if self._wire.missing is not None:
            raise RobotError(f"{self.link}: {self._wire.missing}")
        self._open, self._fault_logged = True, None
        self._opened += 1
        self._waiting.clear()
        self._wire._ports.append(self)
        self._heard = self._wire.clock.now()
        self._look_later(self._opened)

    def listen_to(self, wanted: Iterable[Filter] | None) -> None:
        """Drop all frames but those that one of the filters lets through; None hears everything again."""
        self._wanted = None if wanted is None else list(wanted)

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        """Send a frame, or raise.

        Raises:
            RobotError: the bus is closed or full, or its adapter is in trouble.
        """
        if not self._open:
            raise RobotError(f"{self.link}: expected an open bus, this one is closed")
        if self._wire.trouble is not None:
            raise RobotError(f"{self.link}: {self._wire.trouble}")
        if not self._wire.put(frame, self, urgent=urgent):
            raise RobotError(f"{self.link}: the transmit queue is full")

    def restart(self) -> str | None:
        """Bring the controller back, unless it is stuck."""
        return self._wire.stuck

    def stop(self) -> None:
        """Close the bus. Idempotent."""
        if self._open:
            self._open = False
            self._wire._ports.remove(self)

    def freeze(self) -> None:
        """The process of this adapter does not run any more: its frames wait."""
        self._frozen = True

    def thaw(self) -> None:
        """The process runs again, and finds what has waited."""
        self._frozen = False
        waiting, self._waiting = self._waiting, []
        for frame in waiting:
            self.hear(frame)

    def hear(self, frame: Frame) -> None:
        """A frame has arrived."""
        if self._frozen:
            self._waiting.append(frame)
            return
        if self._wanted is not None and not any(wanted.passes(frame) for wanted in self._wanted):
            return
        self._heard = self._wire.clock.now()
        self._call(self._on_frame, frame)

    def _call(self, callback: Callable[[T], None], argument: T) -> None:
        """Call a callback; an exception is trouble of the bus, unless it is to end the simulation."""
        try:
            callback(argument)
        except Exception as error:
            if self._strict:
                raise
            log.exception("%s: %r could not be handled", self.link, argument)
            if callback is not self._on_trouble:
                self._on_trouble(f"{self.link}: {argument!r} could not be handled: {error!r}")

    def _look_later(self, opened: int) -> None:
        self._wire.clock.at(
            max(self._heard, self._wire.clock.now() - IDLE_TIMEOUT / 2) + IDLE_TIMEOUT, lambda: self._look(opened)
        )

    def _look(self, opened: int) -> None:
        """Tell of trouble once, and that nothing was received for a while."""
        if not self._open or opened != self._opened:
            return
        now, trouble = self._wire.clock.now(), self._wire.trouble
        if not self._frozen:
            if trouble is not None and trouble != self._fault_logged:
                self._call(self._on_trouble, f"{self.link}: {trouble}")
            self._fault_logged = trouble
            if now - self._heard >= 0.99 * IDLE_TIMEOUT:
                self._heard = now
                self._call(self._on_quiet, now)
        self._look_later(opened)
