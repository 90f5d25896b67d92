"""An emulated moteus controller; it has no bus and no clock.

It answers reads and writes of its registers in every resolution, holds a velocity or a position, latches faults until
it is stopped, and stops by itself when no setpoint has arrived for the time that the last one has given it. Its console
knows `d stop`, `tel stop`, and `conf get` and `conf set` of servo.timeout_mode.
"""

import math
from collections.abc import Callable, Sequence

from vrg.hal.can.frame import Frame, FrameError
from vrg.hal.can.workshop.emulated import Cycle, EmulatedDrive
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.can.workshop.listener import Claim, Listener
from vrg_drives.moteus import codec
from vrg_drives.moteus.axis import HOST, STOP_SUBFRAMES, MoteusAxis
from vrg_drives.moteus.codec import Console, Resolution, Subframe, SubframeKind
from vrg_drives.moteus.registers import MAP_VERSION, WRAP, Mode, Register, scale_of

_MODEL, _FIRMWARE = 9, 0x0001_0001
_TICK = 0.01
"""s from one look at its watchdog to the next, if no frames come."""
_POSITION_GAIN = 20.0
"""turn/s for each turn of position error."""
_DRIVER_FAULT = 33
_IDS = range(1, 0x7F)
_TIMEOUT_MODES = frozenset(str(int(m)) for m in (Mode.STOPPED, Mode.POSITION, Mode.ZERO_VELOCITY, Mode.BRAKE))
"""The values of servo.timeout_mode: what a drive does whose watchdog has expired."""
_RESET: dict[int, float] = {
    Register.COMMAND_POSITION: 0.0,
    Register.COMMAND_VELOCITY: 0.0,
    Register.COMMAND_FEEDFORWARD_TORQUE: 0.0,
    Register.COMMAND_KP_SCALE: 1.0,
    Register.COMMAND_KD_SCALE: 1.0,
    Register.COMMAND_MAX_TORQUE: math.nan,
    Register.COMMAND_STOP_POSITION: math.nan,
    Register.COMMAND_TIMEOUT: math.nan,
    Register.COMMAND_VELOCITY_LIMIT: math.nan,
    Register.COMMAND_ACCEL_LIMIT: math.nan,
}
"""The registers of a command, which each write of the mode sets back to these values."""


class MoteusDrive(EmulatedDrive):
    """An emulated moteus controller."""

    # It has no input for an emergency stop that it would tell of.
    supports = frozenset(FaultKind) - {FaultKind.ESTOP}

    def _boot(self, now: float) -> None:
        self._mode = Mode.STOPPED
        self._fault = 0
        self._command: dict[int, float] = dict(_RESET)
        self._timeout_mode = Mode.ZERO_VELOCITY
        self._typed = self._printed = b""
        self._tick = Cycle(_TICK, now)
        self._watchdog = 0.0
        self._measures: dict[int, Callable[[], float]] = {
            Register.MODE: lambda: self._mode,
            Register.POSITION: lambda: math.remainder(self._estimates()[0], WRAP),
            Register.VELOCITY: lambda: self._estimates()[1],
            Register.TORQUE: lambda: self.motor.torque,
            Register.Q_CURRENT: lambda: self.motor.current,
            Register.VOLTAGE: lambda: self.options.voltage,
            Register.TEMPERATURE: lambda: 25.0,
            Register.FAULT: lambda: self._fault,
            Register.MILLISECONDS: lambda: int(1000 * (self._now - self._booted)) & 0x7FFFFFFF,
            Register.MODEL_NUMBER: lambda: _MODEL,
            Register.FIRMWARE_VERSION: lambda: _FIRMWARE,
            Register.REGISTER_MAP_VERSION: lambda: MAP_VERSION,
            Register.MULTIPLEX_ID: lambda: self.node,
            Register.SERIAL_1: lambda: _signed(self.options.serial),
            Register.SERIAL_2: lambda: _signed(self.options.serial >> 32),
            Register.SERIAL_3: lambda: _signed(self.options.serial >> 64),
        }

    def _cycles(self) -> Sequence[Cycle]:
        return (self._tick,)

    def _cyclic(self, now: float) -> list[Frame]:
        self._tick.due(now)
        return []  # it speaks only when it is asked

    @property
    def _energised(self) -> bool:
        return self._mode in (Mode.POSITION, Mode.TIMEOUT, Mode.ZERO_VELOCITY)

    def _hear(self, frame: Frame, now: float) -> list[Frame]:
        source, destination, reply = codec.address_of(frame.id)
        if not codec.is_plain(frame) or destination not in (self.node, codec.BROADCAST):
            return []
        if text := codec.console_text(frame, Console.TYPE):
            self._type(text)
        if codec.console_text(frame, Console.ASK) is not None and reply:
            most = frame.data[2]
            told, self._printed = self._printed[:most], self._printed[most:]
            return [codec.console(self.node, source, Console.TELL, told)]
        try:
            subframes = codec.decode(frame)
        except FrameError:
            return []
        node = self.node
        commanded = False
        answers = []
        for subframe in subframes:
            if subframe.kind is SubframeKind.WRITE:
                commanded |= self._write(subframe)
            elif subframe.kind is SubframeKind.READ:
                answers.append(self._read(subframe))
        if commanded:
            self._obey(now)
        if not reply:
            return []
        try:
            return [codec.encode(node, source, answers)]
        except ValueError:
            return []  # more was asked than fits into a frame

    def _type(self, text: bytes) -> None:
        """Text is typed into the console, which answers each whole line."""
        *lines, self._typed = (self._typed + text).split(b"\n")
        for line in lines:
            match line.decode("latin-1").split():
                case ["d", "stop"]:
                    self._stop()
                    self._printed += b"OK\r\n"
                case []:
                    pass
                case ["conf", "get", "servo.timeout_mode"]:
                    self._printed += b"%d\r\n" % self._timeout_mode
                case ["conf", "set", "servo.timeout_mode", mode] if mode in _TIMEOUT_MODES:
                    self._timeout_mode = Mode(int(mode))
                    self._printed += b"OK\r\n"
                case ["tel", "stop"]:
                    self._printed += b"OK\r\n"
                case _:
                    self._printed += b"ERR unknown command\r\n"

    def _stop(self) -> None:
        self._mode, self._fault, self._watchdog = Mode.STOPPED, 0, 0.0

    def _write(self, subframe: Subframe) -> bool:
        """Take in registers that are written; whether a command is among them."""
        commanded = False
        for offset, raw in enumerate(subframe.values):
            number = subframe.register + offset
            value = scale_of(number).value(raw, subframe.resolution)
            if number == Register.MODE:
                commanded = True
                self._command = {**_RESET, Register.MODE: value}
            elif number in _RESET:
                commanded = True
                self._command[number] = value
            elif number == Register.MULTIPLEX_ID and value in _IDS:
                self.node = int(value)
            elif number == Register.SET_OUTPUT_NEAREST and math.isfinite(value):
                self.motor.position = value
        return commanded

    def _obey(self, now: float) -> None:
        """A whole command has arrived."""
        mode = self._command.get(Register.MODE, self._mode)
        if mode == Mode.STOPPED:
            self._stop()
        elif self._mode in (Mode.FAULT, Mode.TIMEOUT):
            return  # only a stop ends either
        elif mode in (Mode.POSITION, Mode.ZERO_VELOCITY):
            self._mode = Mode(int(mode))
            timeout = self._command[Register.COMMAND_TIMEOUT]
            # NaN means the drive's own time-out, and a negative one none.
            self._watchdog = self.options.watchdog if math.isnan(timeout) else max(0.0, timeout)
            self._feed(now)

    def _move(self, dt: float) -> None:
        if self._mode == Mode.TIMEOUT and self._timeout_mode in (Mode.STOPPED, Mode.BRAKE):
            self.motor.coast(dt)
            return
        aim = 0.0
        most = self._command[Register.COMMAND_MAX_TORQUE]
        own = self.motor.model.current_limit
        wanted = own if math.isnan(most) else max(0.0, most) / self.motor.model.torque_constant
        self.motor.current_limit = min(own, wanted)
        if self._mode == Mode.POSITION:
            velocity, position = self._command[Register.COMMAND_VELOCITY], self._command[Register.COMMAND_POSITION]
            aim = velocity if math.isfinite(velocity) else 0.0
            if math.isfinite(position):
                self._command[Register.COMMAND_POSITION] = position + aim * dt
                aim += _POSITION_GAIN * (position - self.motor.position)
        self.motor.turn(dt, aim)

    def _read(self, subframe: Subframe) -> Subframe:
        values = []
        for offset in range(len(subframe.values)):
            number = subframe.register + offset
            value = self._measures[number]() if number in self._measures else self._command.get(number, 0.0)
            values.append(scale_of(number).raw(value, subframe.resolution))
        return Subframe(SubframeKind.REPLY, subframe.register, Resolution(subframe.resolution), tuple(values))

    def _starve(self) -> list[Frame]:
        self._mode, self._watchdog = Mode.TIMEOUT, 0.0
        return []

    def _press_estop(self) -> list[Frame]:
        return []

    def _latch(self, bits: int) -> list[Frame]:
        self._mode, self._fault, self._watchdog = Mode.FAULT, bits & 0x7F or _DRIVER_FAULT, 0.0
        return []


def _signed(number: int) -> int:
    """The lowest 32 bits of a number as a signed one."""
    number &= 0xFFFFFFFF
    return number - (1 << 32) if number >> 31 else number


_GREETING = (codec.read(Register.MODE, 1, Resolution.INT8), codec.read(Register.FAULT, 1, Resolution.INT16))


class MoteusListener(Listener[MoteusAxis]):
    """See `Listener`. A drive is recognised by a CAN FD frame with registers. It only answers."""

    word = "moteus"
    title = "moteus"

    node_type = MoteusAxis

    def claim(self, frame: Frame) -> Claim:
        """An answer of a drive is certainly one: no other protocol here has CAN FD frames."""
        source, destination, _ = codec.address_of(frame.id)
        if not codec.is_plain(frame) or not frame.fd or source not in codec.NODE_IDS or destination in codec.NODE_IDS:
            return Claim.NONE
        try:
            genuine = any(subframe.kind is SubframeKind.REPLY for subframe in codec.decode(frame))
        except FrameError:
            genuine = False
        return Claim.CERTAIN if genuine or source in self.found else Claim.NONE

    def hear(self, frame: Frame) -> None:
        """Take in an answer."""
        self._recognise(codec.address_of(frame.id).source, frame).receive(frame)

    def owns(self, frame: Frame) -> bool:
        """True for a frame to or from a known drive, or to all, that may be one of moteus."""
        if not self.found or not codec.is_plain(frame):
            return False
        source, destination, _ = codec.address_of(frame.id)
        return bool({source, destination} & self.found.keys()) or destination == codec.BROADCAST

    def greet(self) -> None:
        """Ask every drive how it is."""
        self._send(codec.encode(HOST, codec.BROADCAST, _GREETING, reply=True))

    def ask(self, node: MoteusAxis) -> None:
        """Ask a drive for its values; the answers come to `hear`, so that this waits for nothing."""
        node.identify(0.0)

    def clear(self, node: MoteusAxis) -> None:
        """Let a drive forget its fault."""
        node.clear()

    def stop(self) -> None:
        """Stop every drive: all at once, and each that is known by its id as well."""
        # One that is answered has an identifier of 29 bits, which ODrives and CANopen do not hear.
        for number in (codec.BROADCAST, *self.found):
            self._send(codec.encode(HOST, number, (*STOP_SUBFRAMES, *_GREETING), reply=True), urgent=True)

    def rename(self, node: MoteusAxis, serial: str, to: int) -> None:
        """Give a drive another id, which it keeps until it is switched off, unless it is saved.

        Raises:
            RobotError: it could not be sent.
        """
        order = codec.write(Register.MULTIPLEX_ID, [to], Resolution.INT8)
        self._send(codec.encode(HOST, node.node, [order]))
