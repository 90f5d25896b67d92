"""An emulated VESC; it has no bus and no clock.

It obeys every setpoint of speed, current and brake, lets go of the motor when none has arrived for its time-out,
reports its status by itself, and answers questions for its version, its fault and the flags of its time-out. A fault
lets go of the motor and is forgotten half a second later, as a real one's.
"""

import enum
import math
import os
from collections.abc import Mapping, Sequence
from typing import ClassVar

from vrg.hal.can.axis import Send
from vrg.hal.can.frame import CLASSIC_BYTES, Frame, FrameError
from vrg.hal.can.workshop.emulated import Cycle, EmulatedDrive
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.can.workshop.listener import ANSWER_TIMEOUT, Claim, Listener
from vrg.hal.clock import MonotonicClock
from vrg_drives.vesc import codec
from vrg_drives.vesc.axis import MIN_ERPM, OLDEST, VescAxis, VescOptions
from vrg_drives.vesc.codec import DRV, Comm, Firmware, Packet, Status, Status5

POLE_PAIRS = 7
"""Pole pairs of the emulated motor, unless another number is given."""
_FAULT_STOP = 0.5
"""s after which a fault is forgotten."""


class _Control(enum.Enum):
    """The quantity that the motor is asked for."""

    NOTHING = enum.auto()
    SPEED = enum.auto()
    CURRENT = enum.auto()
    BRAKE = enum.auto()


_CONTROLS = {
    Packet.SET_RPM: (_Control.SPEED, 1.0),
    Packet.SET_CURRENT: (_Control.CURRENT, 1e-3),
    Packet.SET_CURRENT_BRAKE: (_Control.BRAKE, 1e-3),
    Packet.SET_CURRENT_HANDBRAKE: (_Control.BRAKE, 1e-3),
}
"""The control mode of each setpoint, and the unit of its number."""


class VescDrive(EmulatedDrive):
    """An emulated VESC. Its kill switch stays pressed until the fault is ended."""

    wiring: ClassVar[Mapping[str, object]] = {"pole_pairs": POLE_PAIRS}
    # Integers cannot be NaN.
    supports = frozenset(FaultKind) - {FaultKind.NAN}

    def _boot(self, now: float) -> None:
        self._control, self._aim = _Control.NOTHING, 0.0
        self._fault, self._fault_until = 0, now
        self._timed_out = False
        self._status = Cycle(self.options.encoder, now)

    def _cycles(self) -> Sequence[Cycle]:
        return (self._status,)

    @property
    def _pairs(self) -> int:
        options = self.options.protocol
        return (options.pole_pairs if isinstance(options, VescOptions) else None) or POLE_PAIRS

    @property
    def _energised(self) -> bool:
        return self._control is not _Control.NOTHING

    @property
    def _killed(self) -> bool:
        """True if the kill switch is pressed."""
        return self._has(FaultKind.ESTOP)

    def _cyclic(self, now: float) -> list[Frame]:
        if not self._status.due(now):
            return []
        position, velocity = self._estimates()
        steps = round(position * self._pairs * codec.TACHO_STEPS)
        # Where nothing drives it, the back-EMF of a motor that turns has the same duty cycle.
        duty = velocity / self.motor.model.velocity_limit
        return [
            codec.status_frame(self.node, Status(round(velocity * 60 * self._pairs), self.motor.current, duty)),
            codec.status_5_frame(self.node, Status5((steps + 2**31) % 2**32 - 2**31, self.options.voltage)),
        ]

    def _hear(self, frame: Frame, now: float) -> list[Frame]:
        if not frame.extended or frame.remote or codec.node_of(frame) not in (self.node, codec.BROADCAST):
            return []
        packet = codec.packet_of(frame)
        if packet in codec.SETPOINTS:
            self._obey(Packet(packet), frame, now)
        elif packet == Packet.PING and frame.data:
            return [Frame(codec.frame_id(Packet.PONG, frame.data[0]), bytes([self.node, 0]), extended=True)]
        elif packet == Packet.PROCESS_SHORT_BUFFER and len(frame.data) >= 3:
            answer = self._interpret(frame.data[2:])
            return codec.payload_frames(frame.data[0], self.node, answer) if answer else []
        return []

    def _obey(self, packet: Packet, frame: Frame, now: float) -> None:
        """A setpoint has arrived. Those that are not emulated do nothing, and feed the time-out as a real one's do."""
        try:
            value = codec.value_of(frame)
        except FrameError:
            return
        self._feed(now)
        self._timed_out = False
        if self._killed or now < self._fault_until:
            return
        self._control, unit = _CONTROLS.get(packet, (_Control.NOTHING, 0.0))
        self._aim = value * unit
        if self._control is _Control.CURRENT and not self._aim:
            self._control = _Control.NOTHING

    def _interpret(self, payload: bytes) -> bytes:
        """The answer to a question; empty where there is none."""
        if payload[0] == Comm.FW_VERSION:
            return codec.firmware_payload(Firmware(OLDEST[0], OLDEST[1], "VRG", f"{self.options.serial:X}"))
        if payload[0] == Comm.GET_VALUES_SELECTIVE and len(payload) >= 5:
            bits = int.from_bytes(payload[1:5], "big")
            if bits == codec.FAULT_BIT:
                return codec.values_payload(bits, self._fault if self._now < self._fault_until else 0)
            if bits == codec.FLAGS_BIT:
                expired = self._timed_out or (self._watchdog > 0 and self._now - self._fed > self._watchdog)
                return codec.values_payload(bits, expired * codec.TIMED_OUT | self._killed * codec.KILL_SWITCH)
        return b""

    def _move(self, dt: float) -> None:
        match self._control:
            case _Control.SPEED if abs(self._aim) >= MIN_ERPM:
                self.motor.turn(dt, self._aim / 60 / self._pairs)
            case _Control.CURRENT:
                self.motor.pull(dt, self._aim * self.motor.model.torque_constant)
            case _Control.SPEED:
                self.motor.coast(dt)
            case _:
                self.motor.turn(dt, 0.0)

    def _starve(self) -> list[Frame]:
        self._control, self._timed_out = _Control.NOTHING, True
        return []

    def _press_estop(self) -> list[Frame]:
        self._control = _Control.NOTHING
        self._until[FaultKind.ESTOP] = math.inf
        return []

    def _latch(self, bits: int) -> list[Frame]:
        self._control = _Control.NOTHING
        self._fault, self._fault_until = bits & 0xFF or DRV, self._now + _FAULT_STOP
        return []


_TOLD = (Packet.STATUS, Packet.STATUS_2, Packet.STATUS_3, Packet.STATUS_4, Packet.STATUS_5, Packet.STATUS_6)


_STANDSTILL_ERPM = 60
"""The electrical speed below which a motor stands."""


class VescNode(VescAxis):
    """An axis that only listens. A motor that turns is on, as far as is known: at a steady speed its current is low."""

    def _report_on(self, on: bool, at: float) -> None:
        super()._report_on(on or abs(self.erpm) > _STANDSTILL_ERPM, at)


class VescListener(Listener[VescAxis]):
    """See `Listener`. A drive is recognised by its status messages, or by its answer to a ping.

    It counts electrical revolutions, so that turns of the shaft are known to the wiring alone and not reported.
    """

    word = "vesc"
    title = "VESC"

    node_type = VescNode

    def __init__(self, send: Send, clock: MonotonicClock) -> None:
        super().__init__(send, clock)
        self._host = codec.own_id(os.getpid())

    def claim(self, frame: Frame) -> Claim:
        """A status message is likely one: other protocols may use the same identifiers. A pong fits."""
        if not frame.extended or frame.remote or frame.fd:
            return Claim.NONE
        packet, node = codec.packet_of(frame), codec.node_of(frame)
        if node == self._host:
            return Claim.FITTING if packet == Packet.PONG or self.found else Claim.NONE
        if packet not in _TOLD or len(frame.data) != CLASSIC_BYTES or node not in codec.NODE_IDS:
            return Claim.NONE
        return Claim.FITTING if node in self.found else Claim.LIKELY

    def owns(self, frame: Frame) -> bool:
        """True for a frame to or from a known drive, or to all."""
        if not frame.extended or frame.remote or codec.packet_of(frame) not in set(Packet):
            return False
        return codec.node_of(frame) in self.found or (codec.node_of(frame) == codec.BROADCAST and bool(self.found))

    def hear(self, frame: Frame) -> None:
        """Take in a frame."""
        if codec.node_of(frame) != self._host:
            self._recognise(codec.node_of(frame), frame).receive(frame)
        elif codec.packet_of(frame) == Packet.PONG:
            if frame.data and frame.data[0] in codec.NODE_IDS:
                self._recognise(frame.data[0], frame).receive(frame)
        else:
            for node in self.found.values():
                node.receive(frame)

    def greet(self) -> None:
        """Ask every drive to show itself."""
        ping = Frame(codec.frame_id(Packet.PING, codec.BROADCAST), bytes([self._host]), extended=True)
        self._send(ping)

    def ask(self, node: VescAxis) -> None:
        """Ask a drive for its version and its fault. Answers of several at once would get mixed up, so this waits."""
        node.clear()  # it asks for the fault that there is now
        self._send(codec.ask_values(node.host, node.node, codec.FLAGS_BIT))
        node.forget_serials()
        node.ask_serial()
        self._clock.wait(lambda: node.serials, ANSWER_TIMEOUT)

    def clear(self, node: VescAxis) -> None:
        """Forget a drive's fault."""
        node.clear()

    def stop(self) -> None:
        """Let every drive go of its motor: all at once, and each that is known by its id as well."""
        for number in (codec.BROADCAST, *self.found):
            self._send(codec.setpoint(Packet.SET_CURRENT, number, 0), urgent=True)
