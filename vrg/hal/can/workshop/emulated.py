"""The common part of all emulated drives: a motor, time, a watchdog, and faults on request.

A drive has no bus and no clock: it is called with the monotonic time, and answers with the frames that it sends.
"""

import math
import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from msgspec.structs import replace

from vrg.hal.can.axis import ProtocolOptions
from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, decode_fault, encode_answer, is_fault_request
from vrg.hal.can.workshop.motor import Motor, MotorModel

BOOT = 0.3
"""s of silence while a drive starts."""
_COASTING = 0.1
"""s from one look at a motor to the next, while its drive is frozen."""
_JUMP = 1000
"""turns by which an encoder jumps."""
_RUNAWAY, _SCALE = 3, 60
"""The factors by which a motor runs away too fast, and by which an encoder reports too high a speed."""
_LASTING = frozenset(FaultKind) - {
    FaultKind.END, FaultKind.REBOOT, FaultKind.ESTOP, FaultKind.ERROR, FaultKind.JUMP,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class DriveOptions:
    """The options of one emulated drive.

    Args:
        serial: the serial number, which no other drive should have.
        motor: the motor and its load.
        watchdog: s without a setpoint after which the motor is switched off; 0 = never.
        voltage: voltage of the supply, V.
        heartbeat, encoder, supply: the periods of these three kinds of frames, s.
        protocol: what a person has to say of such a drive, see vrg.hal.can.axis; None where that is nothing.
    """

    serial: int
    motor: MotorModel = field(default_factory=MotorModel)
    watchdog: float = 0.2
    voltage: float = 24.0
    heartbeat: float = 0.1
    encoder: float = 0.01
    supply: float = 1.0
    protocol: ProtocolOptions | None = None


class Cycle:
    """Something that is due again and again."""

    def __init__(self, period: float, now: float, phase: float = 0.0) -> None:
        self.period = period
        self.next = now + phase * period if period else math.inf

    def due(self, now: float) -> bool:
        """True if it is due; a drive that was late does not make up for what it missed."""
        if now < self.next:
            return False
        self.next = max(self.next + self.period, now + self.period / 2)
        return True


class EmulatedDrive(ABC):
    """The common part of all emulated drives.

    Args:
        node: its id on the bus. options: what it is like.
        now: monotonic time at which it is switched on, s.
        rng: garbage on request is made from it.

    Attributes:
        supports: the kinds of faults that can be asked of it.
        motor: its motor, as it truly is.
        wiring: the options of its protocol in the wiring of a robot that drives it, as in a match file.
    """

    wiring: ClassVar[Mapping[str, object]] = {}
    supports: ClassVar[frozenset[FaultKind]] = frozenset(FaultKind)

    def __init__(self, node: int, options: DriveOptions, now: float, rng: random.Random) -> None:
        self.node = node
        self.options = options
        self.motor = Motor(options.motor)
        self._rng = rng
        self._now = now
        self._until: dict[FaultKind, float] = {}
        self._values: dict[FaultKind, int] = {}
        self._turned_at = 0.0
        self._booted = now
        self._fed = now
        self._late: Sequence[Frame] = ()
        self._watchdog = options.watchdog
        self._boot(now)

    @property
    def due(self) -> float:
        """Monotonic time at which `step` next has something to do, s; infinite where only a frame can change that."""
        if self._has(FaultKind.FREEZE):
            # It has nothing to say, but its motor goes on.
            return min(self._until[FaultKind.FREEZE], self._now + _COASTING)
        return min([self._booted] if self._now < self._booted else [cycle.next for cycle in self._cycles()])

    def receive(self, frame: Frame, now: float) -> list[Frame]:
        """Receive a frame of another node, and answer it."""
        self._advance(now)
        if is_fault_request(frame, self.node):
            try:
                request = decode_fault(frame)
            except FrameError:
                return []
            # The answer goes out whatever goes wrong from now on.
            answer = encode_answer(self.node, request.kind, done=request.kind in self.supports)
            return [answer, *self._shown(self._break(request, now))]
        if now < self._booted or self._has(FaultKind.FREEZE):
            return []
        return self._shown(self._hear(frame, now))

    def step(self, now: float) -> list[Frame]:
        """Let time pass, and send what is due."""
        self._advance(now)
        if now < self._booted or self._has(FaultKind.FREEZE):
            return []
        return self._shown(self._cyclic(now))

    @abstractmethod
    def _boot(self, now: float) -> None:
        """Begin from the start: idle and without errors. The constructor calls it too."""

    @abstractmethod
    def _cycles(self) -> Sequence[Cycle]:
        """Everything that is due again and again."""

    @abstractmethod
    def _hear(self, frame: Frame, now: float) -> list[Frame]:
        """Do what a frame asks for, and answer it."""

    @abstractmethod
    def _cyclic(self, now: float) -> list[Frame]:
        """The frames that are due now."""

    @property
    @abstractmethod
    def _energised(self) -> bool:
        """True if the motor is under control."""

    @abstractmethod
    def _move(self, dt: float) -> None:
        """Let the motor, which is under control, do what the newest setpoint asks for."""

    @abstractmethod
    def _starve(self) -> list[Frame]:
        """The watchdog has expired: switch off. What this returns goes out with the next frames."""

    @abstractmethod
    def _press_estop(self) -> list[Frame]:
        """An emergency stop button at the drive is pressed: switch off, until errors are cleared."""

    @abstractmethod
    def _latch(self, bits: int) -> list[Frame]:
        """An error has occurred: switch off until it is cleared. `bits`: the error in the protocol's code; 0 = any."""

    def _feed(self, now: float) -> None:
        """A setpoint has arrived: the watchdog starts again."""
        self._fed = now

    def _estimates(self) -> tuple[float, float]:
        """The estimates of the encoder: position in turns, velocity in turn/s."""
        if self._has(FaultKind.NAN):
            return math.nan, math.nan
        position, velocity = self.motor.position, self.motor.velocity
        if self._has(FaultKind.REVERSE):
            position, velocity = 2 * self._turned_at - position, -velocity
        if self._has(FaultKind.SCALE):
            velocity *= self._values[FaultKind.SCALE] or _SCALE
        return position, velocity

    def _has(self, kind: FaultKind) -> bool:
        return self._now < self._until.get(kind, -math.inf)

    def _advance(self, now: float) -> None:
        dt, self._now = max(0.0, now - self._now), max(now, self._now)
        self.motor.blocked = self._has(FaultKind.BLOCK)
        self.motor.stuck = self._has(FaultKind.STUCK)
        self.motor.excess = (self._values[FaultKind.RUNAWAY] or _RUNAWAY) if self._has(FaultKind.RUNAWAY) else 1
        starves = self._fed + self._watchdog if self._watchdog else math.inf
        if not self._energised or self._has(FaultKind.FREEZE):
            self.motor.coast(dt)
        elif now >= starves:
            driven = max(0.0, min(dt, starves - (now - dt)))
            self._move(driven)
            self._late = self._starve()
            self.motor.coast(dt - driven)
        else:
            self._move(dt)

    def _break(self, request: FaultRequest, now: float) -> list[Frame]:
        if request.kind not in self.supports:
            return []
        if request.kind in _LASTING:
            self._until[request.kind] = now + request.duration if request.duration else math.inf
            self._values[request.kind] = request.value
        actions: dict[FaultKind, Callable[[], list[Frame]]] = {
            FaultKind.ESTOP: self._press_estop,
            FaultKind.ERROR: lambda: self._latch(request.value & 0xFFFFFFFF),
        }
        match request.kind:
            case FaultKind.END:
                self._until.clear()
            case FaultKind.REBOOT:
                self._restart(now)
            case FaultKind.REVERSE:
                self._turned_at = self.motor.position
            case FaultKind.JUMP:
                self.motor.position += request.value or _JUMP
        return actions.get(request.kind, list)()

    def _restart(self, now: float) -> None:
        self._until.clear()
        self._booted = now + BOOT
        self.motor.position = self.motor.velocity = 0.0
        self._boot(self._booted)

    def _shown(self, frames: list[Frame]) -> list[Frame]:
        """The frames that really go out, after faults."""
        frames, self._late = [*self._late, *frames], ()
        if self._has(FaultKind.SILENCE):
            return []
        if self._has(FaultKind.GARBAGE):
            return [replace(f, data=self._rng.randbytes(len(f.data))) for f in frames]
        if self._has(FaultKind.LENGTH):
            # Not every length can be that of a CAN FD frame; half of one can.
            return [replace(f, data=f.data[: len(f.data) // 2] if f.fd else f.data[:-1]) for f in frames]
        return frames
