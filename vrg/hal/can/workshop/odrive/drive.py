"""An emulated ODrive axis that speaks CANSimple 0.6; it has no bus and no clock.

It answers requests, sends its cyclic frames, latches errors, and feeds its watchdog by setpoints alone. What a
setpoint means is the controller mode's: velocity (as it is or along a ramp), position (as it is, filtered, or along a
trajectory) or torque. The endpoints of its SDOs are its own: 1 watchdog time-out, 2 velocity limit, 3 velocity ramp,
all float32. Its settings are lost when it starts again, unless they were saved.
"""

import math
import random
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.messages import AxisError, AxisState, Command, ControlMode, ProcedureResult
from vrg.hal.can.workshop.emulated import Cycle, DriveOptions, EmulatedDrive
from vrg.hal.can.workshop.odrive.inputs import Filter, InputMode, Trajectory

_VERSION = messages.Version(messages.PROTOCOL_VERSION, 4, 4, 58, 0, 6, 11, 0)
_POSITION_GAIN = 20.0
"""turn/s for each turn of position error; this is the real drive's default."""
_RAMP = 200.0
"""The acceleration along a ramp, turn/s^2."""
_FILTER_BANDWIDTH = 2.0
"""1/s; this is the real drive's default."""
_TRAJECTORY = (10.0, 20.0, 20.0)
"""The highest velocity of a trajectory, turn/s, and its acceleration and deceleration, turn/s^2."""
_SAVE, _ERASE = 1, 2
_REBOOTS = (0, _SAVE, _ERASE)
"""What can be done before it starts again."""
_LARGEST = 1e6
"""turn/s or A; a limit beyond it is no limit, and would not fit into the numbers that a drive sends."""


@dataclass(frozen=True)
class _Settings:
    """What a drive can save."""

    node: int
    watchdog: float
    velocity_limit: float
    current_limit: float
    ramp: float = _RAMP


class OdriveDrive(EmulatedDrive):
    """See the module. Node 63 is a drive without an id: it sends no heartbeat, and waits to be given one."""

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
        self._modes = messages.SetControllerMode(ControlMode.VELOCITY, InputMode.PASSTHROUGH)
        self._aim = 0.0
        self._ramped = 0.0
        self._filter = Filter(_FILTER_BANDWIDTH)
        self._trajectory = Trajectory(*_TRAJECTORY)
        self._recall()
        self._heartbeat = Cycle(self.options.heartbeat, now)
        self._encoder = Cycle(self.options.encoder, now)
        self._supply = Cycle(self.options.supply, now)

    def _recall(self) -> None:
        """Have the saved settings again."""
        saved = self._saved
        self.node, self._watchdog, self._ramp = saved.node, saved.watchdog, saved.ramp
        self.motor.velocity_limit, self.motor.current_limit = saved.velocity_limit, saved.current_limit

    def _save(self) -> None:
        """Keep the settings."""
        limits = self.motor.velocity_limit, self.motor.current_limit
        self._saved = _Settings(self.node, self._watchdog, *limits, self._ramp)

    def _cycles(self) -> Sequence[Cycle]:
        return (self._heartbeat, self._encoder, self._supply)

    def _cyclic(self, now: float) -> list[Frame]:
        due = [c.due(now) for c in (self._heartbeat, self._encoder, self._supply)]
        if self.node == codec.BROADCAST:
            return []
        commands = (Command.HEARTBEAT, Command.ENCODER_ESTIMATES, Command.BUS_VOLTAGE_CURRENT)
        return [f for c, is_due in zip(commands, due, strict=True) if is_due for f in self._tell(c)]

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
        if address.serial == self.options.serial and address.node in codec.NODES:
            self.node = address.node
        elif address.serial != self.options.serial and address.node == self.node:
            # Another drive has been given this one's id: it waits for a new one.
            self.node = codec.BROADCAST
        return []

    def _obey(self, message: messages.Message, now: float) -> list[Frame]:
        match message:
            case messages.SetInputVel(velocity):
                self._setpoint(ControlMode.VELOCITY, velocity, now)
            case messages.SetInputPos(position):
                self._setpoint(ControlMode.POSITION, position, now)
            case messages.SetInputTorque(torque):
                self._setpoint(ControlMode.TORQUE, torque, now)
            case messages.SetAxisState(state):
                self._request(state, now)
            case messages.Reboot(action) if not self._energised and action in _REBOOTS:
                if action == _SAVE:
                    self._save()
                elif action == _ERASE:
                    self._saved = self._blank
                self._restart(now)
            case messages.Estop():
                return self._press_estop()
            case messages.RxSdo():
                return self._endpoint(message)
            case _:
                self._configure(message)
        return []

    def _configure(self, message: messages.Message) -> None:
        match message:
            case messages.SetControllerMode():
                self._modes = message
            case messages.SetLimits(velocity, current):
                if 0 < velocity < _LARGEST and 0 < current < _LARGEST:
                    self.motor.velocity_limit, self.motor.current_limit = velocity, current
            case messages.ClearErrors():
                self._active = self._reason = AxisError(0)
            case messages.SetAbsolutePosition(position):
                if math.isfinite(position):
                    self.motor.position = position

    def _request(self, state: int, now: float) -> None:
        """An axis state is asked for; those that calibrate end at once, as there is nothing to calibrate."""
        self._result = 0
        if state == AxisState.CLOSED_LOOP_CONTROL:
            if self._active or self._reason:
                self._result = ProcedureResult.INVALID_STATE
            elif not self._energised:
                self._state = AxisState.CLOSED_LOOP_CONTROL
                self._ramped = self.motor.velocity
                for way in (self._filter, self._trajectory):
                    way.position, way.velocity = self.motor.position, self.motor.velocity
                self._aim = self._aim if self._modes.control_mode != ControlMode.POSITION else self.motor.position
                self._feed(now)
        elif state in set(AxisState):
            self._state = AxisState.IDLE
        else:
            self._result = ProcedureResult.INVALID_STATE

    def _setpoint(self, mode: int, value: float, now: float) -> None:
        if not math.isfinite(value):
            self._disarm(AxisError.BAD_CONFIG)
            return
        self._feed(now)
        if mode == self._modes.control_mode:
            self._aim = value

    def _move(self, dt: float) -> None:
        match self._modes.control_mode:
            case ControlMode.TORQUE:
                self.motor.pull(dt, self._aim)
            case ControlMode.POSITION:
                self.motor.turn(dt, _POSITION_GAIN * (self._approached(dt) - self.motor.position))
            case _ if self._modes.input_mode == InputMode.VEL_RAMP:
                change = self._ramp * dt
                self._ramped += max(-change, min(change, self._aim - self._ramped))
                self.motor.turn(dt, self._ramped)
            case _:
                self.motor.turn(dt, self._aim)

    def _approached(self, dt: float) -> float:
        """Where on the way to its aim the position is to be now, turns."""
        match self._modes.input_mode:
            case InputMode.POS_FILTER:
                return self._filter.follow(self._aim, dt)
            case InputMode.TRAP_TRAJ:
                return self._trajectory.follow(self._aim, dt)
            case _:
                return self._aim

    def _tell(self, command: int) -> list[Frame]:
        position, velocity = self._estimates()
        motor = self.motor
        power = motor.torque * motor.velocity * 2 * math.pi
        errors = self._active | self._reason
        known: dict[int, messages.Message] = {
            Command.VERSION: _VERSION,
            Command.HEARTBEAT: messages.Heartbeat(errors, self._state, self._result, int(self._trajectory.done)),
            Command.ERROR: messages.Error(self._active, self._reason),
            Command.ADDRESS: messages.Address(self.node, self.options.serial),
            Command.ENCODER_ESTIMATES: messages.EncoderEstimates(position, velocity),
            Command.IQ: messages.Iq(motor.current, motor.current),
            Command.TEMPERATURE: messages.Temperature(25.0, 25.0),
            Command.BUS_VOLTAGE_CURRENT: messages.BusVoltageCurrent(
                self.options.voltage, power / self.options.voltage if self.options.voltage else 0.0
            ),
            Command.TORQUES: messages.Torques(motor.torque, motor.torque),
            Command.POWERS: messages.Powers(power, power),
        }
        message = known.get(command)
        return [] if message is None else [codec.encode(self.node, message)]

    def _endpoint(self, request: messages.RxSdo) -> list[Frame]:
        names = {1: "watchdog", 2: "velocity_limit", 3: "ramp"}
        name = names.get(request.endpoint)
        if name is None:
            return []
        if request.opcode == 1:
            (value,) = struct.unpack("<f", struct.pack("<I", request.value))
            if math.isfinite(value) and value >= 0:
                self._write(name, value)
        (raw,) = struct.unpack("<I", struct.pack("<f", self._read(name)))
        return [codec.encode(self.node, messages.TxSdo(0, request.endpoint, raw))]

    def _read(self, name: str) -> float:
        return {
            "watchdog": self._watchdog,
            "velocity_limit": self.motor.velocity_limit,
            "ramp": self._ramp,
        }[name]

    def _write(self, name: str, value: float) -> None:
        if name == "watchdog":
            self._watchdog = value
        elif name == "velocity_limit":
            self.motor.velocity_limit = value
        else:
            self._ramp = value

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


_TELLABLE = frozenset(
    {
        Command.VERSION, Command.HEARTBEAT, Command.ERROR, Command.ENCODER_ESTIMATES, Command.IQ,
        Command.TEMPERATURE, Command.BUS_VOLTAGE_CURRENT, Command.TORQUES, Command.POWERS, Command.ADDRESS,
    }
)  # fmt: skip
"""What an empty frame asks for, as a remote one does."""
