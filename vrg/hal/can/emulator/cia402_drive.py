"""An emulated servo drive that speaks CiA 402 over CANopen. Pure.

It is a network slave (NMT, heartbeat, EMCY), an SDO server (canopen's protocol over the objects here), four RPDOs and
four TPDOs with whatever mapping a master gives them, and the state machine of CiA 402 in profile velocity mode. What it
is strict about is what masters get wrong: a PDO is mapped only while the node is not operational, the PDO is switched
off and its number of entries is 0; an inhibit time is changed only while the PDO is switched off.

Its watchdog is the deadline of a RPDO (0x1400:05): it runs from the first frame of that RPDO on, as CiA 301 has it, and
every frame of it starts it anew. When it expires the drive says so (EMCY 0x8250), and has a fault if its motor was on.
A TPDO of type 254 or 255 goes out when a state in it changes (not a measurement) and at every tick of its event timer;
of type 1 to 240 at every such number of SYNCs. Not here: remote requests, block transfers, node guarding, saving.
"""

import math
import random
import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import can
from canopen import objectdictionary
from canopen.objectdictionary import ODVariable
from canopen.sdo.exceptions import SdoAbortedError
from canopen.sdo.server import SdoServer

from vrg.hal.can import cia402
from vrg.hal.can.cia402 import Control, DriveState, Function, Nmt, NmtCommand, Object
from vrg.hal.can.emulator.drive import Cycle, DriveOptions, EmulatedDrive
from vrg.hal.can.emulator.faults import FaultKind
from vrg.hal.can.frame import Frame

_VOLTAGE_ENABLED, _REMOTE, _TARGET_REACHED, _NO_QUICK_STOP = 1 << 4, 1 << 9, 1 << 10, 1 << 5
"""Bits of the statusword that stand for no state."""
_POWERED = frozenset(
    {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE}
)  # fmt: skip
_STANDSTILL = 0.05
"""turn/s."""
_REACHED = 0.2
"""turn/s from the target at which it counts as reached."""
_OVERCURRENT = 0x2310
_EVENTS = frozenset({Object.STATUSWORD, Object.ERROR_CODE, Object.ERROR_REGISTER, Object.MODE_DISPLAY})
"""A change of these lets a TPDO of type 254 or 255 go out."""
_MEASURED = _EVENTS | {Object.POSITION, Object.VELOCITY, Object.VOLTAGE}
_ASYNCHRONOUS = (254, 255)
_LAST_SYNCHRONOUS = 240
_ENTRIES = 8
"""In one PDO."""
_NMT_STATES = {
    NmtCommand.START: Nmt.OPERATIONAL,
    NmtCommand.STOP: Nmt.STOPPED,
    NmtCommand.PRE_OPERATIONAL: Nmt.PRE_OPERATIONAL,
}
_NO_OBJECT, _NO_SUB, _WRITE_ONLY, _READ_ONLY = 0x0602_0000, 0x0609_0011, 0x0601_0001, 0x0601_0002
_NOT_MAPPABLE, _PDO_TOO_LONG, _WRONG_LENGTH = 0x0604_0041, 0x0604_0042, 0x0607_0010
_BAD_VALUE, _NOT_NOW, _UNSUPPORTED = 0x0609_0030, 0x0800_0022, 0x0601_0000


class Objects:
    """The drive's object dictionary with its values, as canopen's SDO server wants a node.

    Args:
        measured: gives the values of objects that are measured. wrote: told of every object that was written.
        refused: the abort code of a write that is not allowed now, 0 for none.
    """

    def __init__(
        self,
        node: int,
        measured: Callable[[int], int | None],
        refused: Callable[[int, int, int], int],
        wrote: Callable[[int, int, int], None],
    ) -> None:
        self.object_dictionary = cia402.object_dictionary(node)
        self._measured = measured
        self._refused = refused
        self._wrote = wrote
        self._values: dict[tuple[int, int], int | str] = {}

    def __getitem__(self, key: tuple[int, int]) -> Any:
        """The value of an object by index and sub-index."""
        for value in (self._measured(key[0]), self._values.get(key)):
            if value is not None:
                return value
        return self.find(*key).default

    def __setitem__(self, key: tuple[int, int], value: int | str) -> None:
        self._values[key] = value

    def find(self, index: int, sub: int) -> ODVariable:
        """What is known of an object.

        Raises:
            SdoAbortedError: there is none.
        """
        if index not in self.object_dictionary:
            raise SdoAbortedError(_NO_OBJECT)
        found = self.object_dictionary[index]
        if isinstance(found, ODVariable):
            if sub:
                raise SdoAbortedError(_NO_SUB)
            return found
        if sub not in found:
            raise SdoAbortedError(_NO_SUB)
        return found[sub]

    def get_data(self, index: int, sub: int, check_readable: bool = False) -> bytes:
        """For the SDO server."""
        variable = self.find(index, sub)
        if check_readable and not variable.readable:
            raise SdoAbortedError(_WRITE_ONLY)
        return variable.encode_raw(self[index, sub])

    def set_data(self, index: int, sub: int, data: bytes, check_writable: bool = False) -> None:
        """For the SDO server."""
        variable = self.find(index, sub)
        if check_writable and not variable.writable:
            raise SdoAbortedError(_READ_ONLY)
        if variable.data_type in objectdictionary.NUMBER_TYPES and 8 * len(data) != len(variable):
            raise SdoAbortedError(_WRONG_LENGTH)
        value: Any = variable.decode_raw(bytes(data))
        abort = self._refused(index, sub, value)
        if abort:
            raise SdoAbortedError(abort)
        self[index, sub] = value
        self._wrote(index, sub, value)


class _Server(SdoServer):
    """canopen's server, which takes it for granted that no transfer goes on before one has begun."""

    def __init__(self, node: int, objects: Objects, network: "_Outbox") -> None:
        super().__init__(Function.SDO_REQUEST | node, Function.SDO_ANSWER | node, objects)  # type: ignore[no-untyped-call]
        self.network: Any = network
        self._index = self._subindex = 0
        self._buffer = bytearray()


class _Outbox:
    """What the SDO server takes for a network: it collects the answers."""

    def __init__(self) -> None:
        self._frames: list[Frame] = []

    def send_message(self, can_id: int, data: bytes) -> None:
        """One answer."""
        self._frames.append(Frame(can_id, bytes(data)))

    def take(self) -> list[Frame]:
        """All answers since the last time."""
        frames, self._frames = self._frames, []
        return frames


class _Pdo:
    """One PDO's settings, read from the objects whenever they are needed, and its timers."""

    def __init__(self, objects: Objects, number: int, communication: int, mapping: int) -> None:
        self._objects = objects
        self.communication = communication + number
        self.mapping = mapping + number
        self.due = math.inf  # of a TPDO its next tick, of a RPDO its deadline
        self.allowed = -math.inf
        self.last: tuple[int, ...] | None = None
        self.syncs = 0
        self.held = b""

    @property
    def on(self) -> bool:
        """Whether it is used."""
        return not self.setting(cia402.COB_ID) & cia402.NOT_VALID

    @property
    def identifier(self) -> int:
        """Of its frames."""
        return self.setting(cia402.COB_ID) & 0x7FF

    @property
    def kind(self) -> int:
        """Transmission type."""
        return self.setting(cia402.TRANSMISSION)

    @property
    def timer(self) -> float:
        """Event timer, s."""
        return self.setting(cia402.EVENT_TIMER) / 1000

    def setting(self, sub: int) -> int:
        """A communication parameter."""
        value: int = self._objects[self.communication, sub]
        return value

    @property
    def entries(self) -> Iterator[tuple[int, int, int]]:
        """Index, sub-index and bytes of each object in it."""
        for sub in range(1, self._objects[self.mapping, 0] + 1):
            entry = self._objects[self.mapping, sub]
            yield entry >> 16, entry >> 8 & 0xFF, (entry & 0xFF) // 8


class Cia402Drive(EmulatedDrive):
    """See the module."""

    protocol = "cia402"
    # Integers cannot be NaN.
    supports = frozenset(FaultKind) - {FaultKind.NAN}

    def __init__(self, node: int, options: DriveOptions, now: float, rng: random.Random) -> None:
        self._outbox = _Outbox()
        super().__init__(node, options, now, rng)

    def _boot(self, now: float) -> None:
        self._objects = Objects(self.node, self._measure, self._refuse, self._wrote)
        self._server = _Server(self.node, self._objects, self._outbox)
        self._objects[Object.IDENTITY, cia402.SERIAL] = self.options.serial & 0xFFFFFFFF
        self._objects[Object.HEARTBEAT_TIME, 0] = round(self.options.heartbeat * 1000)
        self._objects[Object.RPDO + 1, cia402.EVENT_TIMER] = round(self.options.watchdog * 1000)
        self._rpdos = [_Pdo(self._objects, n, Object.RPDO, Object.RPDO_MAPPING) for n in range(cia402.PDOS)]
        self._tpdos = [_Pdo(self._objects, n, Object.TPDO, Object.TPDO_MAPPING) for n in range(cia402.PDOS)]
        self._pdo_of = {mapping: p for p in (*self._rpdos, *self._tpdos) for mapping in (p.communication, p.mapping)}
        self._nmt = Nmt.BOOTED
        self._state = DriveState.SWITCH_ON_DISABLED
        self._error = 0
        self._word = 0
        self._speed = 0.0
        self._watchdog = 0.0
        self._heartbeat = Cycle(self.options.heartbeat, now)
        self._clock = Cycle(0.0, now)
        self._clock.next = now

    def _cycles(self) -> Sequence[Cycle]:
        return (self._heartbeat, self._clock)

    @property
    def _energised(self) -> bool:
        return self._state in _POWERED

    @property
    def _units(self) -> cia402.Units:
        increments, turns = (self._objects[Object.ENCODER_RESOLUTION, sub] for sub in (1, 2))
        found = cia402.units(increments, turns, self._objects[Object.VELOCITY_UNIT, 0])
        assert found is not None
        return found

    def _hear(self, frame: Frame, now: float) -> list[Frame]:
        if frame.extended or frame.remote or self._nmt == Nmt.BOOTED:
            return []
        sent: list[Frame] = []
        if frame.id == Function.NMT:
            sent = self._network(frame, now)
        elif frame.id == Function.SDO_REQUEST | self.node:
            if len(frame.data) == 8 and self._nmt != Nmt.STOPPED:
                self._serve(frame)
        elif self._nmt == Nmt.OPERATIONAL:
            if frame.id == cia402.SYNC:
                sent = self._synchronise()
            for pdo in self._rpdos:
                if pdo.on and frame.id == pdo.identifier:
                    sent += self._setpoints(pdo, frame.data, now)
        return [*sent, *self._outbox.take(), *self._due(now)]

    def _cyclic(self, now: float) -> list[Frame]:
        sent: list[Frame] = []
        if self._nmt == Nmt.BOOTED:
            self._nmt = Nmt.PRE_OPERATIONAL
            sent.append(self._heart(Nmt.BOOTED))
            self._heartbeat.next = now + self._heartbeat.period if self._heartbeat.period else math.inf
        if self._heartbeat.due(now):
            sent.append(self._heart(self._nmt))
        return sent + self._due(now)

    def _heart(self, state: Nmt) -> Frame:
        return Frame(Function.HEARTBEAT | self.node, bytes([state]))

    def _network(self, frame: Frame, now: float) -> list[Frame]:
        """An NMT command."""
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
        for pdo in (*self._rpdos, *self._tpdos):
            pdo.due, pdo.last = math.inf, None
            if state == Nmt.OPERATIONAL and pdo in self._tpdos and pdo.timer:
                pdo.due = now + pdo.timer
        self._watchdog = 0.0
        # Nobody can command a drive that is not operational.
        return self._fail(0x8100) if self._energised else []

    def _serve(self, frame: Frame) -> None:
        """An SDO request."""
        try:
            self._server.on_request(frame.id, bytearray(frame.data), 0.0)  # type: ignore[no-untyped-call]
        except (struct.error, can.CanError):
            self._outbox.take()

    def _refuse(self, index: int, sub: int, value: int) -> int:
        """The abort code of a write, 0 where it is allowed."""
        pdo = self._pdo_of.get(index)
        if pdo is None:
            return _BAD_VALUE if index == Object.MODE and value not in (0, cia402.PROFILE_VELOCITY) else 0
        return (self._refuse_setting if index == pdo.communication else self._refuse_entry)(pdo, sub, value)

    def _refuse_setting(self, pdo: _Pdo, sub: int, value: int) -> int:
        if sub == cia402.TRANSMISSION:
            synchronous = (0 if pdo in self._rpdos else 1) <= value <= _LAST_SYNCHRONOUS
            return 0 if synchronous or value in _ASYNCHRONOUS else _BAD_VALUE
        if sub == cia402.COB_ID:
            moves = pdo.on and not value & cia402.NOT_VALID and value & 0x7FF != pdo.identifier
            return _BAD_VALUE if moves else 0
        return _NOT_NOW if sub == cia402.INHIBIT and pdo.on else 0

    def _refuse_entry(self, pdo: _Pdo, sub: int, value: int) -> int:
        if pdo.on or self._nmt == Nmt.OPERATIONAL:
            return _NOT_NOW
        if sub:
            return _UNSUPPORTED if self._objects[pdo.mapping, 0] else self._unmappable(pdo, value)
        if value > _ENTRIES:
            return _PDO_TOO_LONG
        entries = [self._objects[pdo.mapping, n] for n in range(1, value + 1)]
        bad = next((abort for abort in (self._unmappable(pdo, entry) for entry in entries) if abort), 0)
        return bad or (_PDO_TOO_LONG if sum(entry & 0xFF for entry in entries) > 64 else 0)

    def _unmappable(self, pdo: _Pdo, entry: int) -> int:
        try:
            variable = self._objects.find(entry >> 16, entry >> 8 & 0xFF)
        except SdoAbortedError as error:
            return error.code
        fits = variable.pdo_mappable and len(variable) == entry & 0xFF
        return 0 if fits and (variable.writable or pdo in self._tpdos) else _NOT_MAPPABLE

    def _wrote(self, index: int, sub: int, value: int) -> None:
        """An object was written, by SDO or RPDO."""
        pdo = self._pdo_of.get(index)
        if pdo is not None:
            pdo.due = math.inf
            pdo.last = None
            if pdo in self._tpdos and pdo.on and pdo.timer:
                pdo.due = self._now + pdo.timer
            self._guard()
        elif index == Object.HEARTBEAT_TIME:
            self._heartbeat = Cycle(value / 1000, self._now)
        elif index == Object.CONTROLWORD:
            self._control(value)

    def _setpoints(self, pdo: _Pdo, data: bytes, now: float) -> list[Frame]:
        """A RPDO has come."""
        if len(data) < sum(size for _, _, size in pdo.entries):
            return [self._emergency(0x8210)]
        if pdo.timer:
            pdo.due = now + pdo.timer
            self._feed(now)
            self._guard()
        if pdo.kind in _ASYNCHRONOUS:
            self._apply(pdo, data)
        else:
            pdo.held = data
        return []

    def _apply(self, pdo: _Pdo, data: bytes) -> None:
        at = 0
        for index, sub, size in pdo.entries:
            value = data[at : at + size]
            at += size
            try:
                self._objects.set_data(index, sub, value)
            except SdoAbortedError:
                continue  # a mode that there is not; the others of the frame hold

    def _synchronise(self) -> list[Frame]:
        """A SYNC has come."""
        for pdo in self._rpdos:
            if pdo.held:
                self._apply(pdo, pdo.held)
                pdo.held = b""
        sent = []
        for pdo in self._tpdos:
            if pdo.on and 0 < pdo.kind <= _LAST_SYNCHRONOUS:
                pdo.syncs += 1
                if pdo.syncs >= pdo.kind:
                    pdo.syncs = 0
                    sent.append(self._telegram(pdo))
        return sent

    def _due(self, now: float) -> list[Frame]:
        """Deadlines that have passed while the motor was off, and TPDOs whose time or news has come."""
        sent = []
        for pdo in self._rpdos:
            if now >= pdo.due:
                pdo.due = math.inf
                sent.append(self._emergency(cia402.RPDO_TIMEOUT))
        self._guard()
        if self._nmt == Nmt.OPERATIONAL:
            for pdo in self._tpdos:
                if pdo.on and pdo.kind in _ASYNCHRONOUS and now >= pdo.allowed and self._has_news(pdo, now):
                    pdo.allowed = now + pdo.setting(cia402.INHIBIT) / 10_000
                    pdo.due = now + pdo.timer if pdo.timer else math.inf
                    sent.append(self._telegram(pdo))
        waits = [max(pdo.due, pdo.allowed) for pdo in self._tpdos] + [p.allowed for p in self._tpdos if p.allowed > now]
        self._clock.next = min([pdo.due for pdo in self._rpdos] + waits)
        return sent

    def _has_news(self, pdo: _Pdo, now: float) -> bool:
        states = tuple(self._objects[index, sub] for index, sub, _ in pdo.entries if index in _EVENTS)
        changed, pdo.last = pdo.last is None or states != pdo.last, states
        return changed or now >= pdo.due

    def _telegram(self, pdo: _Pdo) -> Frame:
        data = b"".join(self._objects.get_data(index, sub) for index, sub, _ in pdo.entries)
        return Frame(pdo.identifier, data)

    def _guard(self) -> None:
        """The base class' watchdog is the RPDO deadline that ends first."""
        first = min(pdo.due for pdo in self._rpdos)
        self._watchdog = 0.0 if first == math.inf else max(1e-9, first - self._fed)

    def _emergency(self, code: int) -> Frame:
        register = cia402.error_register(code or self._error)
        return Frame(Function.EMCY | self.node, struct.pack("<HB5x", code, register))

    def _fail(self, code: int) -> list[Frame]:
        """Fault: the reaction is 0x605E's, 0 lets go of the motor at once, the others brake it first."""
        if self._state is not DriveState.FAULT:
            brakes = self._energised and self._objects[Object.FAULT_REACTION, 0] != 0
            self._state = DriveState.FAULT_REACTION_ACTIVE if brakes else DriveState.FAULT
        self._error = code
        return [self._emergency(code)]

    def _control(self, word: int) -> None:
        """The state machine: a controlword, by CiA 402's table of commands."""
        rises, self._word = word & ~self._word & Control.FAULT_RESET, word
        state = self._state
        if state is DriveState.FAULT:
            if rises:
                self._state, self._error = DriveState.SWITCH_ON_DISABLED, 0
                self._outbox.send_message(Function.EMCY | self.node, self._emergency(0).data)
        elif state is not DriveState.FAULT_REACTION_ACTIVE and not word & Control.FAULT_RESET:
            if not word & 0x02:
                self._state = DriveState.SWITCH_ON_DISABLED
            elif not word & 0x04:
                self._quick_stop()
            elif not word & 0x01:
                if state is not DriveState.QUICK_STOP_ACTIVE:
                    self._state = DriveState.READY_TO_SWITCH_ON
            else:
                self._switch_on(bool(word & 0x08))

    def _quick_stop(self) -> None:
        if self._state is DriveState.OPERATION_ENABLED:
            self._state = DriveState.QUICK_STOP_ACTIVE
        elif self._state is not DriveState.QUICK_STOP_ACTIVE:
            self._state = DriveState.SWITCH_ON_DISABLED

    def _switch_on(self, enable: bool) -> None:
        """Switch on, or enable operation, which a drive that is ready to switch on does in one go."""
        if self._state in (DriveState.SWITCH_ON_DISABLED, DriveState.QUICK_STOP_ACTIVE):
            return
        if not enable:
            self._state = DriveState.SWITCHED_ON
        elif self._state is not DriveState.OPERATION_ENABLED:
            self._state = DriveState.OPERATION_ENABLED
            self._speed = self.motor.velocity

    def _move(self, dt: float) -> None:
        units = self._units
        braking = self._state is not DriveState.OPERATION_ENABLED
        aim, ramp = 0.0, Object.QUICK_STOP_DECELERATION
        if not braking:
            if not self._word & Control.HALT and self._objects[Object.MODE, 0] == cia402.PROFILE_VELOCITY:
                aim = units.turns_per_s(self._objects[Object.TARGET_VELOCITY, 0])
            ramp = Object.ACCELERATION if abs(aim) > abs(self._speed) else Object.DECELERATION
        change = units.turns_per_s(self._objects[ramp, 0]) * dt
        self._speed += max(-change, min(change, aim - self._speed))
        self.motor.turn(dt, self._speed)
        if braking and abs(self.motor.velocity) < _STANDSTILL:
            stopped = self._state is DriveState.QUICK_STOP_ACTIVE
            self._state = DriveState.SWITCH_ON_DISABLED if stopped else DriveState.FAULT

    def _measure(self, index: int) -> int | None:
        """The value of an object that is not merely kept."""
        if index not in _MEASURED:
            return None
        if index == Object.POSITION:
            return _signed(round(self._estimates()[0] * self._units.counts))
        if index == Object.VELOCITY:
            return self._units.velocity_of(self._estimates()[1])
        mode: int = self._objects[Object.MODE, 0]
        return {
            Object.STATUSWORD: self._statusword,
            Object.ERROR_CODE: self._error,
            Object.ERROR_REGISTER: cia402.error_register(self._error),
            Object.MODE_DISPLAY: mode,
            Object.VOLTAGE: round(self.options.voltage * 1000),
        }[Object(index)]

    @property
    def _statusword(self) -> int:
        word = self._state.value[1] | _REMOTE | _VOLTAGE_ENABLED
        if self._state is DriveState.SWITCH_ON_DISABLED:
            word |= _NO_QUICK_STOP
        if self._state is DriveState.OPERATION_ENABLED:
            aim = self._units.turns_per_s(self._objects[Object.TARGET_VELOCITY, 0])
            word |= _TARGET_REACHED if abs(self.motor.velocity - aim) < _REACHED else 0
        return word

    def _starve(self) -> list[Frame]:
        for pdo in self._rpdos:
            if self._now >= pdo.due:
                pdo.due = math.inf
        self._guard()
        return self._fail(cia402.RPDO_TIMEOUT)

    def _press_estop(self) -> list[Frame]:
        # Safe torque off cuts the current, whatever the fault reaction is.
        self._state = DriveState.FAULT
        return self._fail(cia402.STO)

    def _latch(self, bits: int) -> list[Frame]:
        return self._fail(bits & 0xFFFF or _OVERCURRENT)


def _signed(counts: int) -> int:
    """As 32 bits hold it."""
    return (counts + 2**31) % 2**32 - 2**31
