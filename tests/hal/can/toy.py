"""A protocol as somebody else would write it: codec, axis, emulated drive and listener in one file.

An identifier is `0x100 | node << 3 | kind`, with nodes from 1 to 15. A drive says its state, error and serial number
ten times a second (STATUS) and its position and velocity a hundred times (MOTION). It is told what to do by one byte
(ORDER) and how fast to turn by a float (SPEED).
"""

import enum
import math
import struct
from collections.abc import Sequence
from typing import NamedTuple

from vrg.hal.can.axis import Axis, MotorState, ProtocolOptions, Send
from vrg.hal.can.frame import Filter, Frame
from vrg.hal.can.protocols import Protocol
from vrg.hal.can.workshop.emulated import Cycle, EmulatedDrive
from vrg.hal.can.workshop.listener import Claim, Listener
from vrg.hal.clock import MonotonicClock

PROTOCOL = Protocol(
    "toy",
    axis="tests.hal.can.toy:ToyAxis",
    drive="tests.hal.can.toy:ToyDrive",
    listener="tests.hal.can.toy:ToyListener",
)
NODES = range(1, 16)
MAGIC = 0xA5


class Kind(enum.IntEnum):
    STATUS = 0
    MOTION = 1
    ORDER = 2
    SPEED = 3


class Order(enum.IntEnum):
    IDLE = 0
    RUN = 1
    STOP = 2
    CLEAR = 3


class Error(enum.IntEnum):
    NONE = 0
    STARVED = 1
    STOPPED = 2
    BROKEN = 3


class Status(NamedTuple):
    running: bool
    error: int
    serial: int


_STATUS, _MOTION, _SPEED = struct.Struct("<BBBxI"), struct.Struct("<ff"), struct.Struct("<f")


def identifier(node: int, kind: Kind) -> int:
    return 0x100 | node << 3 | kind


def status_of(data: bytes) -> Status | None:
    if len(data) != _STATUS.size or data[0] != MAGIC:
        return None
    _, running, error, serial = _STATUS.unpack(data)
    return Status(bool(running), error, serial)


class ToyAxis(Axis):
    def __init__(self, node: int, send: Send, clock: MonotonicClock, options: ProtocolOptions | None = None) -> None:
        super().__init__(node, send, clock, options)
        self._wanted = False

    @classmethod
    def check_node(cls, node: int) -> str | None:
        return None if node in NODES else f"expected 1 to 15, got {node}"

    @property
    def filters(self) -> list[Filter]:
        return [Filter(identifier(self.node, Kind.STATUS), 0x7F8)]

    @property
    def identified(self) -> bool:
        return bool(self.serials)

    @property
    def problem(self) -> str | None:
        return self.shared

    def receive(self, frame: Frame) -> None:
        if frame.extended or frame.remote or frame.id & 0x7F8 != identifier(self.node, Kind.STATUS):
            return
        kind = frame.id & 7
        if kind == Kind.STATUS:
            status = status_of(frame.data)
            if status is None:
                self._complain("a malformed frame")
            else:
                self._judge(status, frame.at)
        elif kind == Kind.MOTION:
            if len(frame.data) != _MOTION.size:
                self._complain("a malformed frame")
            else:
                self._estimate(*_MOTION.unpack(frame.data), frame.at)
        elif kind in (Kind.ORDER, Kind.SPEED):
            self._complain("another program commands it too")

    def identify(self, patience: float) -> None:
        pass  # a drive says by itself who it is

    def prepare(self) -> None:
        pass

    def start(self) -> None:
        self.command(0.0)
        self._order(Order.RUN)
        self._wanted, self.expiry_reported = True, False
        if self.state is MotorState.IDLE:
            self.state = MotorState.STARTING

    def command(self, velocity: float) -> None:
        self._send(Frame(identifier(self.node, Kind.SPEED), _SPEED.pack(velocity)))

    def idle(self) -> None:
        self._wanted = False
        if self.state in (MotorState.STARTING, MotorState.CLOSED_LOOP):
            self.state = MotorState.IDLE
        self._order(Order.IDLE)

    def stop_now(self) -> None:
        self._wanted = False
        self._order(Order.STOP)

    def clear(self) -> None:
        self._order(Order.CLEAR)

    def _order(self, order: Order) -> None:
        self._send(Frame(identifier(self.node, Kind.ORDER), bytes([order])))

    def _judge(self, status: Status, at: float) -> None:
        self.heard = at
        self._report_on(status.running, at)
        self.serials.add(f"{status.serial:X}")
        self.watchdog_expired = status.error == Error.STARVED
        self.expiry_reported |= self.watchdog_expired
        self.fault = f"error {status.error}" if status.error >= Error.BROKEN else None
        if status.error == Error.STOPPED:
            self.state = MotorState.ESTOP
        elif self.fault:
            self.state = MotorState.FAULT
        elif status.running:
            self.state = MotorState.CLOSED_LOOP
        else:
            starting = self._wanted and self.state is MotorState.STARTING and not self.watchdog_expired
            self.state = MotorState.STARTING if starting else MotorState.IDLE


class ToyDrive(EmulatedDrive):
    def _boot(self, now: float) -> None:
        self._running = False
        self._error = Error.NONE
        self._aim = 0.0
        self._status = Cycle(self.options.heartbeat, now)
        self._motion = Cycle(self.options.encoder, now)

    def _cycles(self) -> Sequence[Cycle]:
        return (self._status, self._motion)

    @property
    def _energised(self) -> bool:
        return self._running

    def _hear(self, frame: Frame, now: float) -> list[Frame]:
        if frame.extended or frame.remote or not frame.data:
            return []
        if frame.id == identifier(self.node, Kind.SPEED) and len(frame.data) == _SPEED.size:
            (aim,) = _SPEED.unpack(frame.data)
            if math.isfinite(aim):
                self._aim = aim
                self._feed(now)
        elif frame.id == identifier(self.node, Kind.ORDER):
            return self._obey(frame.data[0], now)
        return []

    def _obey(self, order: int, now: float) -> list[Frame]:
        if order == Order.RUN and not self._error:
            self._running = True
            self._feed(now)
        elif order == Order.IDLE:
            self._running = False
        elif order == Order.CLEAR:
            self._error = Error.NONE
        elif order == Order.STOP:
            return self._press_estop()
        return [self._tell()]

    def _cyclic(self, now: float) -> list[Frame]:
        frames = [self._tell()] if self._status.due(now) else []
        if self._motion.due(now):
            frames.append(Frame(identifier(self.node, Kind.MOTION), _MOTION.pack(*self._estimates())))
        return frames

    def _tell(self) -> Frame:
        data = _STATUS.pack(MAGIC, self._running, self._error, self.options.serial & 0xFFFFFFFF)
        return Frame(identifier(self.node, Kind.STATUS), data)

    def _move(self, dt: float) -> None:
        self.motor.turn(dt, self._aim)

    def _fail(self, error: Error) -> list[Frame]:
        self._running, self._error = False, error
        return [self._tell()]

    def _starve(self) -> list[Frame]:
        return self._fail(Error.STARVED)

    def _press_estop(self) -> list[Frame]:
        return self._fail(Error.STOPPED)

    def _latch(self, bits: int) -> list[Frame]:
        return self._fail(Error.BROKEN)


class ToyListener(Listener[ToyAxis]):
    word = "toy"
    title = "Toy"
    node_type = ToyAxis

    def claim(self, frame: Frame) -> Claim:
        if frame.extended or frame.remote or not identifier(1, Kind.STATUS) <= frame.id < 0x180:
            return Claim.NONE
        if frame.id & 7 == Kind.STATUS and status_of(frame.data) is not None:
            return Claim.CERTAIN
        return Claim.CERTAIN if frame.id >> 3 & 0xF in self.found else Claim.NONE

    def hear(self, frame: Frame) -> None:
        self._recognise(frame.id >> 3 & 0xF, frame).receive(frame)

    def stop(self) -> None:
        for number in NODES:
            self._send(Frame(identifier(number, Kind.ORDER), bytes([Order.IDLE])), urgent=True)

    def clear(self, node: ToyAxis) -> None:
        node.clear()

    def ask(self, node: ToyAxis) -> None:
        pass  # a drive tells all by itself
