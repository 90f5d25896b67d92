"""One axis of a moteus controller.

Each setpoint carries the time after which the drive must stop by itself, which sets its watchdog.
A drive whose watchdog has expired is in the mode "timeout" until it is stopped. It then does what its console was told:
here it shorts the phases of its motor, as its default (hold the speed at zero under a current limit) takes longer.
"""

import math

from pydantic import Field

from vrg.errors import RobotError
from vrg.hal.can.axis import NEVER, Axis, MotorState, ProtocolOptions, Send
from vrg.hal.can.frame import EXTENDED_MASK, Filter, Frame, FrameError
from vrg.hal.clock import MonotonicClock
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg_drives.moteus import codec
from vrg_drives.moteus.codec import Console, Resolution, Subframe, SubframeKind
from vrg_drives.moteus.registers import (
    LIMITS,
    MAP_VERSION,
    WRAP,
    Mode,
    Register,
    describe_fault,
    describe_mode,
    describe_version,
    scale_of,
)


class MoteusOptions(ProtocolOptions):
    """The options of a moteus controller.

    Args:
        max_torque: the highest torque of the motor, Nm, sent with each setpoint; None leaves it to the drive.
    """

    max_torque: float | None = Field(None, gt=0, le=1_000)


HOST = 0
"""The id of who commands, as moteus' own tools have it."""
_POLL = 0.04
"""s without an answer after which the drive is asked again."""
_AGAIN = 4
"""The questions in place of one, once a question was not answered. On a bus that loses 30 % of its frames half of all
questions or their answers get lost."""
_TIMEOUT_MODE = str(int(Mode.BRAKE))
_SET_TIMEOUT_MODE = f"conf set servo.timeout_mode {_TIMEOUT_MODE}".encode()
_GET_TIMEOUT_MODE = b"conf get servo.timeout_mode"
"""What the drive does when its watchdog has expired, and the lines for its console, which it forgets when it is off."""
_CONSOLE_TRIES, _CONSOLE_QUESTIONS = 5, 5
"""Times that lines are typed, as they may get lost, and that it is asked what was printed of one."""
_CONSOLE_TIMEOUT, _CONSOLE_PAUSE = 0.5, 0.01
"""s for an answer, and to the next question where nothing was printed."""
_STATUS = (
    codec.read(Register.MODE, 1, Resolution.INT8),
    codec.read(Register.POSITION, 2),
    codec.read(Register.VOLTAGE),
    codec.read(Register.FAULT, 1, Resolution.INT16),
    codec.read(Register.MILLISECONDS, 1, Resolution.INT32),
)
_IDENTITY = (
    codec.read(Register.FIRMWARE_VERSION, 2, Resolution.INT32),
    codec.read(Register.SERIAL_1, 3, Resolution.INT32),
)
_WHOLE = frozenset(
    {
        Register.MODE, Register.FAULT, Register.MILLISECONDS, Register.FIRMWARE_VERSION, Register.REGISTER_MAP_VERSION,
        Register.SERIAL_1, Register.SERIAL_2, Register.SERIAL_3,
    }
)  # fmt: skip
"""The registers whose numbers are whole, also where a drive sends them as floats."""
_COUNTER_END = 0x7FFF0000
"""ms near which the counter of a drive that has run for 24 days starts again."""
_RESTART_SLACK = 50
"""ms by which the counter of a drive may be ahead of the time since it was heard, if it was started again meanwhile."""
STOP_SUBFRAMES = (codec.write(Register.MODE, [Mode.STOPPED], Resolution.INT8),)
"""The subframes that switch a motor off."""


def setpoint(velocity: float, timeout: float, max_torque: float | None = None) -> tuple[Subframe, ...]:
    """The subframes that ask for a velocity in turn/s, wherever the motor is, for at most `timeout` s.

    Args:
        max_torque: Nm; None leaves it to the drive's own limit.
    """
    limit = () if max_torque is None else (codec.write(Register.COMMAND_MAX_TORQUE, [max_torque]),)
    return (
        codec.write(Register.MODE, [Mode.POSITION], Resolution.INT8),
        codec.write(Register.COMMAND_POSITION, [math.nan, velocity]),
        *limit,
        codec.write(Register.COMMAND_TIMEOUT, [timeout]),
    )


class MoteusAxis(Axis):
    """See `Axis` and the module.

    Attributes:
        options: a person's options for the drive.
    """

    options: MoteusOptions
    options_type = MoteusOptions

    def __init__(self, node: int, send: Send, clock: MonotonicClock, options: ProtocolOptions | None = None) -> None:
        super().__init__(node, send, clock, options)
        self.wrap = WRAP
        self._map: int | None = None
        self._mode: int | None = None
        self._wanted = self._stopping = False
        self._polled = NEVER
        self._uptime, self._uptime_at = 0, NEVER
        self._console: bytes | None = None

    @classmethod
    def check_node(cls, node: int) -> str | None:
        """A drive has an id from 1 to 126; 127 means everybody."""
        return None if node in codec.NODE_IDS else f"expected 1 to {codec.NODE_IDS[-1]}, got {node}"

    @property
    def filters(self) -> list[Filter]:
        """The frames that the drive sends, whichever host has asked it, and those that any host sends to it or to
        all."""
        heads = [(self.node << 8, 0xFF00), (self.node, 0x7F), (codec.BROADCAST, 0x7F)]
        standard = [Filter(id_, mask & 0x7FF) for id_, mask in heads if id_ <= 0x7FF]
        return [*standard, *(Filter(id_, mask & EXTENDED_MASK, extended=True) for id_, mask in heads)]

    @property
    def words(self) -> str:
        """The drive's mode, in words; empty before it is known."""
        return "" if self._mode is None else describe_mode(self._mode)

    @property
    def identified(self) -> bool:
        """True if version and serial number have been received."""
        return self._map is not None and bool(self.serials)

    @property
    def problem(self) -> str | None:
        """An old register map, or two drives with this id."""
        if self.shared:
            return self.shared
        if self._map is not None and self._map < MAP_VERSION:
            return f"expected register map version {MAP_VERSION} or newer, got {self._map}: update the drive's firmware"
        return None

    def forget(self) -> None:
        """Let the drive say again who and what it is."""
        super().forget()
        self._map = None

    def forget_implausible(self) -> None:
        """Judge again what is heard from now on."""
        super().forget_implausible()
        self._uptime, self._uptime_at = 0, NEVER

    def receive(self, frame: Frame) -> None:
        """Hear a frame."""
        if not codec.is_plain(frame):
            return
        source, destination, _ = codec.address_of(frame.id)
        mine = destination in (self.node, codec.BROADCAST)
        if not mine and source != self.node:
            return
        if mine and source != self.node and codec.console_text(frame, Console.TYPE):
            self._complain("another program commands it too, by its diagnostic channel")
        if source == self.node and (text := codec.console_text(frame, Console.TELL)) is not None:
            self._console = text
            return
        try:
            subframes = codec.decode(frame)
        except FrameError as error:
            # Frames between other nodes may belong to another protocol.
            if source == self.node and not mine:
                self._complain(f"a malformed frame: {error}")
            return
        if mine and source != self.node:
            for subframe in subframes:
                if subframe.kind is SubframeKind.WRITE:
                    self._complain(f"another program commands it too: it writes register 0x{subframe.register:03X}")
        elif source == self.node:
            self._answer(subframes, frame.at)

    def identify(self, patience: float) -> None:
        """Ask for version, serial number and state; the answers come to `receive`, so that this waits for nothing."""
        self.ask_serial()
        self._send(codec.encode(HOST, self.node, _STATUS, reply=True))

    def ask_serial(self) -> None:
        """Ask for version and serial number."""
        self._send(codec.encode(HOST, self.node, _IDENTITY, reply=True))

    def prepare(self) -> None:
        """Let its watchdog brake the motor; waits for the console's answer.

        Raises:
            RobotError: the drive refuses, or does not answer.
        """
        told = ""
        for _ in range(_CONSOLE_TRIES):
            refused = self._type(_SET_TIMEOUT_MODE)
            if (told := self._type(_GET_TIMEOUT_MODE)) == _TIMEOUT_MODE:
                return
            told = refused or told
        raise RobotError(
            f"node {self.node}: expected it to take `{_SET_TIMEOUT_MODE.decode()}`, so that its watchdog brakes, got "
            f"{told or 'no answer'}: update the drive's firmware"
        )

    def _type(self, line: bytes) -> str:
        """Type a line into the console; the first line that it prints of it, empty where none comes."""
        # Text that others have typed, or have not read, comes first.
        self._send(codec.console(HOST, self.node, Console.TYPE, b"\n"))
        for _ in range(_CONSOLE_QUESTIONS):
            if not self._ask_console():
                break
        self._send(codec.console(HOST, self.node, Console.TYPE, line + b"\n"))
        text = b""
        for _ in range(_CONSOLE_QUESTIONS):
            text += self._ask_console()
            if b"\n" in text:
                break
        return text.decode("latin-1").partition("\n")[0].strip()

    def _ask_console(self) -> bytes:
        """What the console has printed since it was asked last; empty if nothing yet, or if it does not answer."""
        self._console = None
        self._send(codec.console(HOST, self.node, Console.ASK))
        self._clock.wait(lambda: self._console is not None, _CONSOLE_TIMEOUT)
        if not self._console:
            self._clock.sleep(_CONSOLE_PAUSE)
        return self._console or b""

    def poll(self, now: float) -> None:
        """Ask for its state: it sends nothing by itself."""
        if now - max(self.heard, self._polled) >= _POLL:
            for _ in range(_AGAIN if self.heard < self._polled else 1):
                self._send(codec.encode(HOST, self.node, _STATUS, reply=True))
            self._polled = now

    def start(self) -> None:
        """Ask for position mode at velocity zero."""
        self._wanted, self.expiry_reported = True, False
        if self.state in (MotorState.IDLE, MotorState.CLOSED_LOOP):
            self.state = MotorState.STARTING
        self.command(0.0)

    def command(self, velocity: float) -> None:
        """Send a setpoint in turn/s, and ask how the drive is."""
        # A setpoint would start a drive that is stopped, and a drive that has a fault takes none.
        if self._stopping:
            self._order_stop(urgent=False)
        elif self._wanted:
            subframes = (*setpoint(velocity, COMMAND_TIMEOUT, self.options.max_torque), *_STATUS)
            self._send(codec.encode(HOST, self.node, subframes, reply=True))

    def idle(self) -> None:
        """Switch the motor off."""
        self._wanted = False
        if self.state in (MotorState.STARTING, MotorState.CLOSED_LOOP):
            self.state = MotorState.IDLE
        self._order_stop(urgent=True)

    def clear(self) -> None:
        """Forget a fault or an expired watchdog, which a stop does."""
        self._order_stop(urgent=False)

    def _order_stop(self, *, urgent: bool) -> None:
        self._stopping = True
        self._send(codec.encode(HOST, self.node, (*STOP_SUBFRAMES, *_STATUS), reply=True), urgent=urgent)

    def _answer(self, subframes: list[Subframe], at: float) -> None:
        """Take in the registers that the drive has sent."""
        values: dict[int, float] = {}
        for subframe in subframes:
            if subframe.kind is SubframeKind.REPLY:
                for offset, raw in enumerate(subframe.values):
                    number = subframe.register + offset
                    values[number] = scale_of(number).value(raw, subframe.resolution)
        for number in _WHOLE & values.keys():
            if not math.isfinite(values[number]):
                self._complain(f"register 0x{number:03X}: expected a whole number, it says {values[number]}")
                return
        if Register.MILLISECONDS in values and not self._watch_uptime(int(values[Register.MILLISECONDS]), at):
            return
        if Register.FIRMWARE_VERSION in values:
            self.firmware = describe_version(int(values[Register.FIRMWARE_VERSION]))
        if Register.REGISTER_MAP_VERSION in values:
            self._map = int(values[Register.REGISTER_MAP_VERSION])
        if Register.SERIAL_3 in values:
            words = (int(values.get(number, 0)) & 0xFFFFFFFF for number in (Register.SERIAL_3, 0x121, 0x120))
            self.serials.add("".join(f"{word:08X}" for word in words).lstrip("0") or "0")
        if Register.POSITION in values and Register.VELOCITY in values:
            self._estimate(values[Register.POSITION], values[Register.VELOCITY], at)
        if Register.VOLTAGE in values:
            self._supply(values[Register.VOLTAGE], at)
        if Register.MODE in values:
            self.heard = at
            mode = int(values[Register.MODE])
            # A drive whose watchdog has expired still holds its motor.
            self._report_on(mode not in (Mode.STOPPED, Mode.FAULT), at)
            self._judge(mode, int(values.get(Register.FAULT, 0)))

    def _watch_uptime(self, milliseconds: int, at: float) -> bool:
        """Notice a drive that was started again: the next setpoint alone would let it drive on.

        Returns:
            False for an answer that was heard out of its order, as gateways repeat some and adapters let some wait.
        """
        if milliseconds < self._uptime < _COUNTER_END:
            # One that was started again has run for no longer than it was not heard.
            if milliseconds > 1000 * (at - self._uptime_at) + _RESTART_SLACK:
                return False
            self._complain("it was started again")
            self._wanted = False
        self._uptime, self._uptime_at = milliseconds, at
        return True

    def _judge(self, mode: int, fault: int) -> None:
        """Set the state by the mode and the fault that the drive reports."""
        self._mode = mode
        if mode in (Mode.STOPPED, Mode.FAULT):
            self._stopping = False
        elif self._stopping:
            return
        self.fault = None
        self.watchdog_expired = mode == Mode.TIMEOUT
        self.expiry_reported |= self.watchdog_expired
        if mode == Mode.FAULT:
            self.state, self._wanted = MotorState.FAULT, False
            self.fault = describe_fault(fault if fault < LIMITS else 0) or "a fault that it gives no reason for"
        elif mode == Mode.POSITION:
            self.state = MotorState.CLOSED_LOOP
        elif mode in (Mode.STOPPED, Mode.TIMEOUT):
            starting = self._wanted and not self.watchdog_expired and self.state is MotorState.STARTING
            self.state = MotorState.STARTING if starting else MotorState.IDLE
        elif mode in (Mode.ENABLING, Mode.CALIBRATING, Mode.CALIBRATION_COMPLETE) and self._wanted:
            self.state = MotorState.STARTING
        else:
            self.state = MotorState.FAULT
            self.fault = f"expected to be stopped or in position mode, it is in {describe_mode(mode)}"
