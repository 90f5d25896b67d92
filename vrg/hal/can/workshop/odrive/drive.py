"""An emulated ODrive axis that speaks CANSimple 0.6; it has no bus and no clock.

It answers requests, sends its cyclic frames, latches errors, and feeds its watchdog by setpoints alone. It controls
velocity; setpoints of position and of torque feed its watchdog and do nothing else, as in a drive of another mode. The
endpoints of its SDOs are its own: 1 watchdog time-out, 2 velocity limit, both float32. Its settings are lost when it
starts again, unless they were saved.
"""

import math
import random
import struct
from collections.abc import Sequence
from typing import NamedTuple

from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.messages import AxisError, AxisState, Command, ProcedureResult
from vrg.hal.can.workshop.emulated import Cycle, DriveOptions, EmulatedDrive

_VERSION = messages.Version(messages.PROTOCOL_VERSION, 4, 4, 58, 0, 6, 11, 0)
_SAVE, _ERASE = 1, 2
_REBOOTS = (0, _SAVE, _ERASE)
"""The requests that end in a reboot."""
_LARGEST = 1e6
"""turn/s or A; a limit beyond it is no limit, and would not fit into the numbers that a drive sends."""
_TELLABLE = (
    Command.VERSION, Command.HEARTBEAT, Command.ENCODER_ESTIMATES, Command.BUS_VOLTAGE_CURRENT, Command.ADDRESS,
)  # fmt: skip
"""The messages that an empty frame asks for, as a remote one does."""


class _Settings(NamedTuple):
    """The settings that a drive can save."""

    node: int
    watchdog: float
    velocity_limit: float
    current_limit: float


class OdriveDrive(EmulatedDrive):
    """An emulated ODrive axis. Node 63 is a drive without an id: it sends no heartbeat, and waits to be given one."""

    def __init__(self, node: int, options: DriveOptions, now: float, rng: random.Random) -> None:
        limits = options.motor.velocity_limit, options.motor.current_limit
        self._saved = _Settings(node, options.watchdog, *limits)
        self._blank = _Settings(codec.BROADCAST, 0.0, *limits)
        super().__init__(node, options, now, rng)

    def _boot(self, now: float) -> None:
        self._state = AxisState.IDLE
        self._active = AxisError(0)
        self._reason = AxisError(0)
        self._result = 0
        self._aim = 0.0
        self.node, self._watchdog, self.motor.velocity_limit, self.motor.current_limit = self._saved
        self._own = {
            Command.HEARTBEAT: Cycle(self.options.heartbeat, now),
            Command.ENCODER_ESTIMATES: Cycle(self.options.encoder, now),
            Command.BUS_VOLTAGE_CURRENT: Cycle(self.options.supply, now),
        }

    def _cycles(self) -> Sequence[Cycle]:
        return tuple(self._own.values())

    def _cyclic(self, now: float) -> list[Frame]:
        due = [command for command, cycle in self._own.items() if cycle.due(now)]
        return [] if self.node == codec.BROADCAST else [frame for command in due for frame in self._tell(command)]

    @property
    def _energised(self) -> bool:
        return self._state == AxisState.CLOSED_LOOP_CONTROL

    def _hear(self, frame: Frame, now: float) -> list[Frame]:
        if frame.extended or frame.fd:
            return []
        node, command = codec.node_of(frame.id), codec.command_of(frame.id)
        if node == codec.BROADCAST and command == Command.ADDRESS:
            return self._address(frame)
        if node not in (self.node, codec.BROADCAST):
            return []
        if frame.remote or (not frame.data and command in _TELLABLE):
            return self._tell(command) if node == self.node else []
        try:
            return self._obey(codec.decode(frame), now)
        except FrameError:
            return []

    def _address(self, frame: Frame) -> list[Frame]:
        """Say who this is, or take an id."""
        if frame.remote or not frame.data:
            return self._tell(Command.ADDRESS)
        try:
            address = codec.decode(frame)
        except FrameError:
            return []
        if not isinstance(address, messages.Address) or self._energised:
            return []
        if address.serial == self.options.serial and address.node in codec.NODE_IDS:
            self.node = address.node
        elif address.serial != self.options.serial and address.node == self.node:
            # Another drive has been given this one's id: it waits for a new one.
            self.node = codec.BROADCAST
        return []

    def _obey(self, message: messages.Message, now: float) -> list[Frame]:
        match message:
            case messages.SetInputVel(velocity):
                self._setpoint(velocity, now)
            case messages.Other(Command.SET_INPUT_POS | Command.SET_INPUT_TORQUE):
                self._feed(now)
            case messages.SetAxisState(state):
                self._request(state, now)
            case messages.Reboot(action) if not self._energised and action in _REBOOTS:
                self._reboot(action, now)
            case messages.Estop():
                return self._press_estop()
            case messages.RxSdo():
                return self._endpoint(message)
            case messages.SetLimits(velocity, current) if 0 < velocity < _LARGEST and 0 < current < _LARGEST:
                self.motor.velocity_limit, self.motor.current_limit = velocity, current
            case messages.ClearErrors():
                self._active = self._reason = AxisError(0)
            case messages.SetAbsolutePosition(position) if math.isfinite(position):
                self.motor.position = position
        return []

    def _setpoint(self, velocity: float, now: float) -> None:
        if math.isfinite(velocity):
            self._feed(now)
            self._aim = velocity
        else:
            self._disarm(AxisError.BAD_CONFIG)

    def _reboot(self, action: int, now: float) -> None:
        if action == _SAVE:
            self._saved = _Settings(self.node, self._watchdog, self.motor.velocity_limit, self.motor.current_limit)
        elif action == _ERASE:
            self._saved = self._blank
        self._restart(now)

    def _request(self, state: int, now: float) -> None:
        """An axis state is asked for; those that calibrate end at once, as there is nothing to calibrate."""
        self._result = 0
        if state == AxisState.CLOSED_LOOP_CONTROL:
            if self._active or self._reason:
                self._result = ProcedureResult.INVALID_STATE
            elif not self._energised:
                self._state = AxisState.CLOSED_LOOP_CONTROL
                self._feed(now)
        elif state in set(AxisState):
            self._state = AxisState.IDLE
        else:
            self._result = ProcedureResult.INVALID_STATE

    def _move(self, dt: float) -> None:
        self.motor.turn(dt, self._aim)

    def _tell(self, command: int) -> list[Frame]:
        motor, volts = self.motor, self.options.voltage
        power = motor.torque * motor.velocity * 2 * math.pi
        known: dict[int, messages.Message] = {
            Command.VERSION: _VERSION,
            Command.HEARTBEAT: messages.Heartbeat(self._active | self._reason, self._state, self._result, 1),
            Command.ADDRESS: messages.Address(self.node, self.options.serial),
            Command.ENCODER_ESTIMATES: messages.EncoderEstimates(*self._estimates()),
            Command.BUS_VOLTAGE_CURRENT: messages.BusVoltageCurrent(volts, power / volts if volts else 0.0),
        }
        message = known.get(command)
        return [] if message is None else [codec.encode(self.node, message)]

    def _endpoint(self, request: messages.RxSdo) -> list[Frame]:
        (value,) = struct.unpack("<f", struct.pack("<I", request.value))
        writes = request.opcode == 1 and math.isfinite(value) and value >= 0
        match request.endpoint:
            case 1:
                value = self._watchdog = value if writes else self._watchdog
            case 2:
                value = self.motor.velocity_limit = value if writes else self.motor.velocity_limit
            case _:
                return []
        (raw,) = struct.unpack("<I", struct.pack("<f", value))
        return [codec.encode(self.node, messages.TxSdo(0, request.endpoint, raw))]

    def _starve(self) -> list[Frame]:
        self._disarm(AxisError.WATCHDOG_TIMER_EXPIRED)
        return []

    def _press_estop(self) -> list[Frame]:
        self._disarm(AxisError.ESTOP_REQUESTED)
        return []

    def _latch(self, bits: int) -> list[Frame]:
        self._disarm(AxisError(bits or AxisError.DRV_FAULT))
        return []

    def _disarm(self, why: AxisError) -> None:
        """The errors that have come stay until they are cleared."""
        self._state = AxisState.IDLE
        self._reason |= why
