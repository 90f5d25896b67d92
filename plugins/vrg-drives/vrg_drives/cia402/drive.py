"""An emulated servo drive that speaks CiA 402 over CANopen; it has no bus and no clock.

It is a network slave (NMT, heartbeat, EMCY), an SDO server, four RPDOs and four TPDOs, and the state machine of CiA 402
in profile velocity mode, with its halt bit. Its watchdog is the deadline of an RPDO (0x1400:05); when it expires the
drive says so (EMCY 0x8250), and has a fault if its motor was on. It has digital outputs (0x60FE), which stay as they
are while the motor is off, and which a fault switches off; the profile leaves both to the maker. It keeps its settings
on the command to save them, and watches its master's heartbeat if it is configured to. It has no block transfers, no
node guarding, no SYNC and no PDOs by remote frames.
"""

import math
import random
import struct
from collections.abc import Callable, Sequence

from vrg.hal.can.frame import Frame
from vrg.hal.can.workshop.emulated import Cycle, DriveOptions, EmulatedDrive
from vrg.hal.can.workshop.faults import FaultKind
from vrg_drives.cia402 import codec
from vrg_drives.cia402 import objects as abort
from vrg_drives.cia402.codec import Control, DriveState, Function, Nmt, NmtCommand, Object
from vrg_drives.cia402.errors import HEARTBEAT_LOST, RPDO_TIMEOUT, STO, error_register
from vrg_drives.cia402.objects import Objects, ObjectServer
from vrg_drives.cia402.pdos import DrivePdos
from vrg_drives.cia402.states import AbortOption, Cia402States, ErrorBehaviour, HeartbeatConsumer
from vrg_drives.cia402.units import Cia402Options, Units, units

_STANDSTILL = 0.05
"""turn/s below which a motor stands."""
_REACHED = 0.2
"""turn/s from the target at which it counts as reached."""
_OVERCURRENT, _COMMUNICATION, _PDO_TOO_SHORT = 0x2310, 0x8100, 0x8210
"""Error codes."""
_NMT_STATES = {
    NmtCommand.START: Nmt.OPERATIONAL,
    NmtCommand.STOP: Nmt.STOPPED,
    NmtCommand.PRE_OPERATIONAL: Nmt.PRE_OPERATIONAL,
}


class Cia402Drive(EmulatedDrive):
    """An emulated servo drive that speaks CiA 402 over CANopen."""

    # Integers cannot be NaN.
    supports = frozenset(FaultKind) - {FaultKind.NAN}

    def __init__(self, node: int, options: DriveOptions, now: float, rng: random.Random) -> None:
        self._said: list[Frame] = []
        self._stored: dict[tuple[int, int], int | str] = {}
        super().__init__(node, options, now, rng)

    @property
    def state(self) -> DriveState:
        """The state of the drive's state machine."""
        return self._machine.state

    @property
    def outputs(self) -> int:
        """The bits of the digital outputs that are on."""
        on: int = self.objects[Object.DIGITAL_OUTPUTS, 1] & self.objects[Object.DIGITAL_OUTPUTS, 2]
        return on

    def _boot(self, now: float) -> None:
        self.objects = Objects(self.node, self._measure, self._refuse, self._wrote)
        self._server = ObjectServer(self.node, self.objects)
        said = self.options.protocol
        if isinstance(said, Cia402Options):
            # A person must state what such a drive does not report itself.
            if said.counts is not None:
                self.objects.remove(Object.ENCODER_RESOLUTION)
            if said.velocity_unit is not None:
                self.objects.remove(Object.VELOCITY_UNIT)
        self.objects[Object.IDENTITY, codec.SERIAL_NUMBER] = self.options.serial & 0xFFFFFFFF
        self.objects[Object.HEARTBEAT_TIME, 0] = round(self.options.heartbeat * 1000)
        self.objects[Object.RPDO + 1, codec.EVENT_TIMER] = round(self.options.watchdog * 1000)
        self.objects.restore(self._stored)
        self.objects[Object.DIGITAL_OUTPUTS, 1] = 0
        self._consumer = HeartbeatConsumer(self.objects)
        self._measures: dict[int, Callable[[], int]] = {
            Object.POSITION: lambda: _signed(round(self._estimates()[0] * self._units.counts)),
            Object.VELOCITY: lambda: self._units.velocity_of(self._estimates()[1]),
            Object.STATUSWORD: self._statusword,
            Object.ERROR_CODE: lambda: self._machine.error,
            Object.ERROR_REGISTER: lambda: error_register(self._machine.error),
            Object.MODE_DISPLAY: self._mode,
            Object.VOLTAGE: lambda: round(self.options.voltage * 1000),
        }
        self._pdos = DrivePdos(self.objects)
        self._machine = Cia402States()
        self._nmt = Nmt.BOOTED
        self._speed = 0.0
        self._watchdog = 0.0
        self._heartbeat = Cycle(self.options.heartbeat, now)
        self._clock = Cycle(0.0, now)
        self._clock.next = now

    def _cycles(self) -> Sequence[Cycle]:
        return (self._heartbeat, self._clock)

    @property
    def _energised(self) -> bool:
        return self._machine.powered

    @property
    def _units(self) -> Units:
        said = self.options.protocol
        counts, unit = (said.counts, said.velocity_code) if isinstance(said, Cia402Options) else (None, None)
        turns = 1
        if counts is None:
            counts, turns = (self.objects[Object.ENCODER_RESOLUTION, sub] for sub in (1, 2))
        found = units(counts, turns, unit or self.objects[Object.VELOCITY_UNIT, 0])
        assert found is not None
        return found

    @property
    def _aim(self) -> float:
        """The target velocity, turn/s."""
        return self._units.turns_per_s(self.objects[Object.TARGET_VELOCITY, 0])

    def _hear(self, frame: Frame, now: float) -> list[Frame]:
        if frame.extended or frame.fd or frame.remote or self._nmt == Nmt.BOOTED:
            return []
        self._consumer.hear(frame, now)
        sent: list[Frame] = []
        if frame.id == Function.NMT:
            sent = self._network(frame, now)
        elif frame.id == Function.SDO_REQUEST | self.node:
            if len(frame.data) == 8 and self._nmt != Nmt.STOPPED:
                sent = self._server.answer(frame)
        elif self._nmt == Nmt.OPERATIONAL:
            sent = self._setpoints(frame, now)
        said, self._said = self._said, []
        return [*said, *sent, *self._due(now)]

    def _cyclic(self, now: float) -> list[Frame]:
        sent: list[Frame] = []
        if self._nmt == Nmt.BOOTED:
            self._nmt = Nmt.PRE_OPERATIONAL
            sent.append(self._heart(Nmt.BOOTED))
            self._heartbeat.next = now + self._heartbeat.period if self._heartbeat.period else math.inf
        if self._heartbeat.due(now):
            sent.append(self._heart(self._nmt))
        return sent + self._due(now)

    def _shown(self, frames: list[Frame]) -> list[Frame]:
        # A node that was stopped sends only its heartbeat (CiA 301).
        stopped = self._nmt == Nmt.STOPPED
        return super()._shown([frame for frame in frames if not stopped or frame.id != Function.EMCY | self.node])

    def _heart(self, state: Nmt) -> Frame:
        return Frame(Function.HEARTBEAT | self.node, bytes([state]))

    def _network(self, frame: Frame, now: float) -> list[Frame]:
        """Obey an NMT command."""
        if len(frame.data) != 2 or frame.data[1] not in (0, self.node):
            return []
        command = frame.data[0]
        if command in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION):
            self._restart(now)
            return []
        state = _NMT_STATES.get(NmtCommand(command)) if command in set(NmtCommand) else None
        if state is None or state == self._nmt:
            return []
        self._nmt = state
        self._pdos.enter(state == Nmt.OPERATIONAL, now)
        self._watchdog = 0.0
        # A drive that is not operational takes no commands.
        return self._cut_off(_COMMUNICATION) if self._energised and state != Nmt.OPERATIONAL else []

    def _cut_off(self, code: int) -> list[Frame]:
        """React to the loss of the master: the drive has a fault, unless by 0x6007 it goes on."""
        return [] if self.objects[Object.ABORT_CONNECTION_OPTION, 0] == AbortOption.NOTHING else self._fail(code)

    def _lose_master(self) -> list[Frame]:
        """The master's heartbeat has not come in time."""
        sent = [self._emergency(HEARTBEAT_LOST)]
        behaviour = self.objects[Object.ERROR_BEHAVIOUR, 1]
        if self._nmt == Nmt.OPERATIONAL and behaviour != ErrorBehaviour.NO_CHANGE:
            self._nmt = Nmt.STOPPED if behaviour == ErrorBehaviour.STOPPED else Nmt.PRE_OPERATIONAL
            self._pdos.enter(False, self._now)
            self._watchdog = 0.0
        return [*sent, *(self._cut_off(HEARTBEAT_LOST) if self._energised else [])]

    def _refuse(self, index: int, sub: int, value: int) -> int:
        """The abort code of a write; 0 where it is allowed."""
        if index == Object.MODE:
            return 0 if value in (0, codec.PROFILE_VELOCITY) else abort.BAD_VALUE
        if index == Object.STORE:
            return 0 if value == codec.SAVE else abort.NOT_STORED
        return self._pdos.refused(index, sub, value)

    def _wrote(self, index: int, sub: int, value: int) -> None:
        """An object was written, by SDO or RPDO."""
        if self._pdos.changed(index, self._now):
            self._watch()
        elif index == Object.HEARTBEAT_TIME:
            self._heartbeat = Cycle(value / 1000, self._now)
        elif index == Object.CONTROLWORD:
            self._control(value)
        elif index == Object.STORE:
            self.objects[index, sub] = 1
            self._stored = self.objects.stored()
        elif index == Object.CONSUMER_HEARTBEAT:
            self._consumer.set_anew()

    def _setpoints(self, frame: Frame, now: float) -> list[Frame]:
        """A frame has arrived that may be an RPDO."""
        sent = []
        for pdo in self._pdos.listening(frame.id):
            if len(frame.data) < pdo.size:
                sent.append(self._emergency(_PDO_TOO_SHORT))
                continue
            self._pdos.take(pdo, frame.data, now)
            if pdo.timer:
                self._feed(now)
                self._watch()
        return sent

    def _due(self, now: float) -> list[Frame]:
        """The frames about deadlines that have passed while the motor was off, and the TPDOs that are due."""
        sent = [self._emergency(RPDO_TIMEOUT) for _ in range(self._pdos.expire(now))]
        if self._consumer.expired(now):
            sent += self._lose_master()
        self._watch()
        sent += self._pdos.telegrams(now)
        self._clock.next = min(self._pdos.next_after(now), self._consumer.due)
        return sent

    def _watch(self) -> None:
        """Set the watchdog of the base class to the RPDO deadline that ends first."""
        first = self._pdos.deadline
        self._watchdog = 0.0 if first == math.inf else max(1e-9, first - self._fed)

    def _emergency(self, code: int) -> Frame:
        register = error_register(code or self._machine.error)
        return Frame(Function.EMCY | self.node, struct.pack("<HB5x", code, register))

    def _fail(self, code: int) -> list[Frame]:
        """A fault has occurred: it lets go of the motor at once, or brakes it first if 0x605E demands it.

        Safe torque off cuts the current, whatever the fault reaction is.
        """
        brakes = code != STO and self._energised and self.objects[Object.FAULT_REACTION, 0] != 0
        self._machine.fail(code, brakes=brakes)
        self.objects[Object.DIGITAL_OUTPUTS, 1] = 0
        return [self._emergency(code)]

    def _control(self, word: int) -> None:
        before = self._machine.state
        if self._machine.control(word):
            self._said.append(self._emergency(0))
        if self._machine.state is DriveState.OPERATION_ENABLED is not before:
            self._speed = self.motor.velocity

    def _move(self, dt: float) -> None:
        braking = self._machine.state is not DriveState.OPERATION_ENABLED
        aim, ramp = 0.0, Object.QUICK_STOP_DECELERATION
        if not braking:
            if self.objects[Object.MODE, 0] == codec.PROFILE_VELOCITY and not self._machine.word & Control.HALT:
                aim = self._aim
            ramp = Object.ACCELERATION if abs(aim) > abs(self._speed) else Object.DECELERATION
        change = self._units.turns_per_s(self.objects[ramp, 0]) * dt
        self._speed += max(-change, min(change, aim - self._speed))
        self.motor.turn(dt, self._speed)
        if braking and abs(self.motor.velocity) < _STANDSTILL:
            self._machine.stand()

    def _measure(self, index: int) -> int | None:
        """The value of an object that is measured; None for one that is merely kept."""
        measure = self._measures.get(index)
        return None if measure is None else measure()

    def _mode(self) -> int:
        mode: int = self.objects[Object.MODE, 0]
        return mode

    def _statusword(self) -> int:
        return self._machine.statusword(abs(self.motor.velocity - self._aim) < _REACHED)

    def _starve(self) -> list[Frame]:
        self._pdos.expire(self._now)
        self._watch()
        return self._fail(RPDO_TIMEOUT)

    def _press_estop(self) -> list[Frame]:
        return self._fail(STO)

    def _latch(self, bits: int) -> list[Frame]:
        return self._fail(bits & 0xFFFF or _OVERCURRENT)


def _signed(counts: int) -> int:
    """The number as 32 bits hold it."""
    return (counts + 2**31) % 2**32 - 2**31
