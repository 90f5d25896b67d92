"""One VESC.

It tells its speed, current and tachometer by itself, if its status messages 1 and 5 are switched on. Its fault, its
time-out and its kill switch must be asked for. The time-out is its watchdog.
"""

import os
from contextlib import suppress

from pydantic import Field

from vrg.hal.can.axis import NEVER, Axis, MotorState, ProtocolOptions, Send
from vrg.hal.can.frame import Filter, Frame, FrameError
from vrg.hal.can.plausibility import was_restarted
from vrg.hal.clock import MonotonicClock
from vrg_drives.vesc import codec
from vrg_drives.vesc.codec import Comm, Packet, describe_fault


class VescOptions(ProtocolOptions):
    """The options of a VESC, which counts electrical revolutions and does not tell how many make one of the shaft.

    Args:
        pole_pairs: pairs of magnetic poles of the motor, half the number of its magnets. It is required.
    """

    pole_pairs: int | None = Field(None, ge=1, le=100)

    @property
    def missing(self) -> str | None:
        """The pole pairs."""
        if self.pole_pairs is not None:
            return None
        return (
            "expected to know how many pole pairs its motor has, as a VESC counts electrical revolutions: write "
            "pole_pairs into [backends.can.robots.<name>.options]; it is half the number of magnets"
        )


OLDEST = (5, 3)
"""The first firmware that reports its time-out."""
MIN_ERPM = 900
"""The slowest speed that it regulates: asked for less, it brakes (the firmware's `s_pid_min_erpm`, its default)."""
_ON_CURRENT = 0.3
"""A beyond which a motor is driven."""
_ROLLED = 0.1
"""The turns by which a motor may have rolled on farther, while its drive was not heard, than its speed says."""
_UNANSWERED = 8
"""Times in a row, 0.05 s apart, that a drive which sends its status may answer nothing; then it hears nothing."""
_DEAF = 3
"""Times in a row after which its robot stands until it answers again."""
_AGAIN = 5
"""The questions at each of those times but the first. On a bus that loses 30 % of its frames, half of all questions or
their answers get lost, and as many in a row as make it deaf, 11, about once in a minute and a half."""
_ID_REQUESTS = 2
"""The number of requests for its id after which the lack of status messages is a problem."""


class VescAxis(Axis):
    """See `Axis` and the module.

    Attributes:
        host: the id by which this process asks the drive. erpm: electrical revolutions a minute, as it reports them.
    """

    encoder_advice = "switch its status message 5 on, at 50 Hz (VESC Tool, App Settings)"
    options: VescOptions
    options_type = VescOptions

    def __init__(self, node: int, send: Send, clock: MonotonicClock, options: ProtocolOptions | None = None) -> None:
        super().__init__(node, send, clock, options)
        self._pairs = self.options.pole_pairs or 1
        self.wrap = 2**32 / (codec.TACHO_STEPS * self._pairs)
        self.slowest = MIN_ERPM / 60 / self._pairs
        self.host = codec.own_id(os.getpid())
        self._answers, self._overheard = codec.Assembler(), codec.Assembler()
        self._versions: set[codec.Firmware] = set()
        self._asked = self._unanswered = 0
        self._polled = NEVER
        self._flags: int | None = None
        self._poll_flags = True
        self._wanted = self._confirmed = False
        self.erpm = 0

    @classmethod
    def check_node(cls, node: int) -> str | None:
        """A drive has an id from 0 to 223; 255 means everybody, and the others are those who ask."""
        return None if node in codec.NODE_IDS else f"expected 0 to {codec.NODE_IDS[-1]}, got {node}"

    @property
    def filters(self) -> list[Filter]:
        """The frames to this drive or from it, those to all, and those to processes that ask, which have the highest
        ids."""
        return [Filter(self.node, 0xFF, extended=True), Filter(codec.HOSTS[0], codec.HOSTS[0], extended=True)]

    @property
    def identified(self) -> bool:
        """True if the version has been received, and both status messages."""
        return bool(self._versions) and (NEVER not in (self.reported_at, self.measured) or self.problem is not None)

    @property
    def problem(self) -> str | None:
        """The poles are unknown, an old firmware, no status messages, or two drives with this id."""
        if self.shared:
            return self.shared
        if missing := self.options.missing:
            return missing
        for version in self._versions:
            if (version.major, version.minor) < OLDEST:
                return (
                    f"expected firmware {OLDEST[0]}.{OLDEST[1]:02d} or newer, got {version.major}.{version.minor:02d}"
                )
        if self._asked > _ID_REQUESTS and self.heard != NEVER and NEVER in (self.reported_at, self.measured):
            number = 1 if self.reported_at == NEVER else 5
            return f"expected its status message {number}: switch 1 and 5 on, at 50 Hz (VESC Tool, App Settings)"
        return None

    def forget(self) -> None:
        """Let the drive say again who and what it is."""
        super().forget()
        self._versions.clear()
        self._asked = 0

    def forget_implausible(self) -> None:
        """Judge again what is heard from now on."""
        super().forget_implausible()
        self._unanswered, self.deaf = 0, False

    def receive(self, frame: Frame) -> None:
        """Hear a frame."""
        if not frame.extended or frame.remote:
            return
        node, packet = codec.node_of(frame), codec.packet_of(frame)
        try:
            if node == self.host:
                self._answer(frame)
            elif node in (self.node, codec.BROADCAST):
                if packet in codec.MOTOR_COMMANDS:
                    self._complain(f"another program commands it too: {Packet(packet).name}")
                elif packet in codec.PAYLOADS:
                    self._overhear(frame)
                elif node == self.node:
                    self._status(packet, frame)
        except FrameError as error:
            self._complain(f"a malformed frame: {error}")

    def identify(self, patience: float) -> None:
        """Ask for the version. Answers of several drives at once would get mixed up, so this waits for it."""
        self._asked += 1
        self.ask_serial()
        self._send(codec.ask_values(self.host, self.node, codec.FLAGS_BIT))
        self._clock.wait(lambda: self._versions, patience)

    def ask_serial(self) -> None:
        """Ask for the version, which has the serial number."""
        self._send(codec.ask(self.host, self.node, bytes([Comm.FW_VERSION])))

    def prepare(self) -> None:
        """Do nothing: a setpoint alone drives it."""

    def poll(self, now: float) -> None:
        """Ask for its flags and its fault, in turns. A drive that answers no more hears no setpoints either."""
        self._unanswered += self.heard > self._polled
        self._polled = now
        self.deaf = self._unanswered >= _DEAF
        if self._unanswered > _UNANSWERED:
            self._complain(
                "it sends its status and answers nothing: it does not hear this computer, or hears it late. Check its "
                "plug, and what is between"
            )
        for _ in range(_AGAIN if self._unanswered else 1):
            bit = codec.FLAGS_BIT if self._poll_flags else codec.FAULT_BIT
            self._poll_flags = not self._poll_flags
            self._send(codec.ask_values(self.host, self.node, bit))

    def start(self) -> None:
        """Send a setpoint of zero; the drive obeys once it reports that its time-out has ended."""
        if self.fault or self.state is MotorState.ESTOP:
            return
        self._ask_anew()  # what it was asked before tells of setpoints of before, however late the answer comes
        self._wanted, self._confirmed, self.expiry_reported, self.watchdog_expired = True, False, False, False
        if self.state is MotorState.IDLE:
            self.state = MotorState.STARTING
        self.command(0.0)
        self._send(codec.ask_values(self.host, self.node, codec.FLAGS_BIT))

    def command(self, velocity: float) -> None:
        """Send a setpoint in turn/s."""
        # The drive would obey it whenever it comes.
        if self._wanted:
            self._send(codec.setpoint(Packet.SET_RPM, self.node, round(velocity * 60 * self._pairs)))

    def idle(self) -> None:
        """Let go of the motor."""
        self._wanted = False
        if self.state in (MotorState.STARTING, MotorState.CLOSED_LOOP):
            self.state = MotorState.IDLE
        self._send(codec.setpoint(Packet.SET_CURRENT, self.node, 0), urgent=True)

    def clear(self) -> None:
        """Forget the fault, which the drive itself does not keep."""
        self.fault, self.watchdog_expired = None, False
        self._send(codec.ask_values(self.host, self.node, codec.FAULT_BIT))
        self._settle()

    def _status(self, packet: int, frame: Frame) -> None:
        """Take in a message that the drive sends by itself."""
        if packet == Packet.STATUS:
            status = codec.decode_status(frame.data)
            self.heard, self.erpm = frame.at, status.erpm
            # The duty cycle tells nothing: a motor that is pushed has one too.
            self._report_on(abs(status.current) > _ON_CURRENT, frame.at)
            self._settle()
        elif packet == Packet.STATUS_5:
            supply = codec.decode_status_5(frame.data)
            self.heard = frame.at
            position = supply.tachometer / codec.TACHO_STEPS / self._pairs
            gap = frame.at - self.measured
            if was_restarted(gap, position, position - self.position, self.velocity, _ROLLED):
                self._complain("it was started again")
                self._wanted = False
            if self.options.pole_pairs is not None:
                self._estimate(position, self.erpm / 60 / self._pairs, frame.at)
            self._supply(supply.voltage, frame.at)

    def _overhear(self, frame: Frame) -> None:
        """Take in a piece of another program's payload to the drive's interpreter."""
        with suppress(FrameError):  # the drive does not obey what is damaged
            whole = self._overheard.take(frame)
            if whole is not None and whole[1] and whole[1][0] not in codec.QUESTIONS:
                self._complain(f"another program commands it too: payload {whole[1][0]}")

    def _answer(self, frame: Frame) -> None:
        """Take in a piece of an answer, of whatever drive: the other axes of this process ask theirs by the same id."""
        try:
            whole = self._answers.take(frame)
        except FrameError:
            # Pieces of two answers got mixed up: a process of another computer has this id too.
            self._ask_anew()
            return
        if whole is None or whole[0] != self.node or not whole[1]:
            return
        payload, self._unanswered, self.deaf = whole[1], 0, False
        if payload[0] == Comm.FW_VERSION:
            version = codec.decode_firmware(payload)
            self._versions.add(version)
            self.firmware = f"{version.major}.{version.minor:02d}"
            self.serials.add(version.serial)
        elif payload[0] == Comm.GET_VALUES_SELECTIVE:
            bits, value = codec.decode_values(payload)
            if value is not None:
                self._value(bits, value)

    def _ask_anew(self) -> None:
        """Ask by another id from now on, so that no answer to an earlier question is heard."""
        self.host = codec.own_id(self.host - codec.HOSTS[0] + 1 + self.node % (len(codec.HOSTS) - 1))

    def _value(self, bits: int, value: int) -> None:
        if bits == codec.FAULT_BIT and value:
            # The drive forgets it after half a second, and would then obey again.
            self.fault, self._wanted = describe_fault(value), False
        elif bits == codec.FLAGS_BIT:
            self._flags = value
            timed_out = bool(value & codec.TIMED_OUT)
            if self._wanted and self._confirmed and timed_out:
                self.watchdog_expired = self.expiry_reported = True
                self._wanted = False
            self._confirmed |= self._wanted and not timed_out
        self._settle()

    def _settle(self) -> None:
        """Set the state by all that the drive has reported."""
        if self._flags is not None and self._flags & codec.KILL_SWITCH:
            self.state, self._wanted = MotorState.ESTOP, False
        elif self.fault:
            self.state = MotorState.FAULT
        elif self._wanted:
            self.state = MotorState.CLOSED_LOOP if self._confirmed else MotorState.STARTING
        elif self.heard != NEVER:
            self.state = MotorState.CLOSED_LOOP if self.on else MotorState.IDLE
