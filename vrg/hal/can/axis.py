"""One motor axis as the layers above see it, whatever protocol its drive speaks.

    SILENT -> IDLE -> STARTING -> CLOSED_LOOP
                ^________|____________|          idle(), or the drive's own watchdog
                FAULT, ESTOP                      latched in the drive until clear()

Angles are turns of the motor's shaft, before any gear. An axis hears frames, and sends them through the function that
it was given. Only `identify` and `prepare` may wait for the drive's answers, by the clock that it was given.
"""

import enum
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Protocol

from vrg.errors import RobotError
from vrg.hal.can.frame import Filter, Frame
from vrg.hal.clock import MonotonicClock
from vrg.tables import Table


class ProtocolOptions(Table):
    """The options of a protocol that has none. Every field of a subclass has a default."""

    @property
    def missing(self) -> str | None:
        """The options that are required and missing, in words; None if nothing is missing."""
        return None


_MOST_VOLTS = 1000.0
"""A supply of more V is none: the highest of a drive on CAN is well below."""
NEVER = -math.inf
"""The stamp of what has not been heard yet, s."""


class MotorState(enum.Enum):
    """The state of an axis: what its drive reports, together with what was asked of it."""

    SILENT = "silent"
    IDLE = "idle"
    STARTING = "starting"
    CLOSED_LOOP = "closed loop"
    FAULT = "fault"
    ESTOP = "emergency stop"


class Send(Protocol):
    """Sends a frame."""

    def __call__(self, frame: Frame, *, urgent: bool = False) -> None:
        """Send it; an urgent one does not wait for others.

        Raises:
            RobotError: it cannot be sent.
        """


class AxisReport:
    """The report of one drive about its axis: plain data, which an `Axis` keeps up to date.

    Args:
        node: the drive's id on the bus.

    Attributes:
        encoder_advice: what to do if the drive sends no encoder messages, in words.
        heard: monotonic time of the newest heartbeat, s. state: the state that it reported.
        on: by the drive's own report its motor is under control; None before the first. reported_at: monotonic
            time of the newest report of that, s. Orders change neither.
        fault: errors that the drive has latched, in words; None while it has none.
        watchdog_expired: the motor is off because no setpoint came in time.
        expiry_reported: the drive itself has reported, since the last `start`, that its watchdog has stopped the motor.
        unwatched: a person has allowed that this drive is driven without a watchdog of its own.
        position, velocity: of the shaft, in turns and turn/s. measured: monotonic time of both, s.
        slowest: the speed in turn/s below which the drive may let its motor stand; 0 where it turns it however slowly.
        wrap: the number of turns after which `position` starts again; 0 where it never does.
        voltage: of the drive's supply, V; None before it was reported. supplied: monotonic time of it, s.
        refusal: why the drive has not started when it was last asked to, in words; None where it has reported nothing.
        implausible: what makes no sense in the frames that were heard, in words: rubbish, a number that is not finite,
            another master; None where everything makes sense.
        serials: the serial numbers of all that have answered to this id, in words: two drives may share it by mistake.
        firmware: the version in words; empty before it is known.
        protocol: the word of its protocol in tables, where a listener has recognised it.
        deaf: it has answered nothing for a moment, though it speaks: it may not hear its setpoints.
        is_drive: False of a node that has said that it has no motor.
    """

    encoder_advice: ClassVar[str] = "switch them on in the drive"

    def __init__(self, node: int) -> None:
        self.node = node
        self.heard = NEVER
        self.state = MotorState.SILENT
        self.on: bool | None = None
        self.reported_at = NEVER
        self.fault: str | None = None
        self.watchdog_expired = False
        self.expiry_reported = False
        self.unwatched = False
        self.position = 0.0
        self.velocity = 0.0
        self.measured = NEVER
        self.slowest = 0.0
        self.wrap = 0.0
        self.voltage: float | None = None
        self.supplied = NEVER
        self.refusal: str | None = None
        self.implausible: str | None = None
        self.serials: set[str] = set()
        self.firmware = ""
        self.protocol = ""
        self.deaf = False
        self.is_drive = True

    @property
    def words(self) -> str:
        """The activity of the drive, in words."""
        return self.state.value

    @property
    def errors(self) -> str:
        """All errors that the drive reports, in words, also those that are no `fault`; empty where there is none."""
        return self.fault or ""

    @property
    def identified(self) -> bool:
        """True if all is known that `problem` needs."""
        return True

    @property
    def problem(self) -> str | None:
        """Why this drive cannot be used, in words: its version, or a second drive of the same id; None where it can."""
        return None

    @property
    def serial(self) -> str:
        """The serial number in words; empty before it is known."""
        return " and ".join(sorted(self.serials))

    @property
    def shared(self) -> str | None:
        """Says that two drives have this id; None where only one has answered."""
        if len(self.serials) < 2:
            return None
        return f"two drives have this id: serial numbers {self.serial}; give one another id"

    @property
    def condition(self) -> tuple[object, ...]:
        """All that it reports but estimates of its encoder and its supply."""
        return self.state, self.on, self.implausible, self.fault, self.watchdog_expired, self.expiry_reported

    def forget_implausible(self) -> None:
        """Judge again what is heard from now on."""
        self.implausible = None

    def forget_serials(self) -> None:
        """Let the drive say again who it is."""
        self.serials.clear()

    def forget(self) -> None:
        """Let the drive say again who and what it is, before it is set up once more."""
        self.forget_implausible()
        self.forget_serials()

    @property
    def traits(self) -> Mapping[str, str]:
        """What the drive has told of itself, in words by their names: a drive of other traits is another one."""
        return {"firmware": self.firmware}


class Axis(AxisReport, ABC):
    """One axis. `receive` is called by the bus' receive thread, and `start` and `command` by the robot's own.

    Any thread may switch it off. They do not call it at the same time (see vrg.hal.can.train).

    Args:
        node: the drive's id on the bus.
        send: sends a frame; raises RobotError where it cannot. Frames that switch the motor off are urgent.
        clock: the time by which answers are waited for.
        options: a person's options for the drive, an `options_type`; None for its defaults.

    Attributes:
        options_type: the options that the protocol has.
        outputs: the bits of the digital outputs that actuators are wired to. It is set before `prepare`.
    """

    options_type: ClassVar[type[ProtocolOptions]] = ProtocolOptions

    def __init__(self, node: int, send: Send, clock: MonotonicClock, options: ProtocolOptions | None = None) -> None:
        super().__init__(node)
        self.options = self.options_type() if options is None else options
        self.outputs = 0
        self._send = send
        self._clock = clock

    @classmethod
    @abstractmethod
    def check_node(cls, node: int) -> str | None:
        """Why a drive cannot have this id, in words, or None where it can."""

    @classmethod
    def check_output(cls, bit: int) -> str | None:
        """Why an actuator cannot be wired to this digital output of a drive, in words, or None where it can."""
        return f"expected none, as VRG knows of no digital outputs in this protocol, got {bit}"

    @property
    @abstractmethod
    def filters(self) -> list[Filter]:
        """The filters for all that this axis must receive once its drive is prepared."""

    @property
    @abstractmethod
    def identified(self) -> bool:
        """True if all is known that `problem` needs."""

    @property
    @abstractmethod
    def problem(self) -> str | None:
        """Why this drive cannot be used, in words: its version, or a second drive of the same id; None where it can."""

    @abstractmethod
    def receive(self, frame: Frame) -> None:
        """Hear a frame, of whatever node."""

    @abstractmethod
    def identify(self, patience: float) -> None:
        """Ask the drive who it is. It may have to be asked again until `identified`.

        Args:
            patience: s that this call may wait for the drive's answers.

        Raises:
            RobotError: a question could not be sent.
        """

    @abstractmethod
    def prepare(self) -> None:
        """Set up what the protocol needs before a start, without energising; may wait for the drive's answers.

        Raises:
            RobotError: the drive refuses, or does not answer.
        """

    @abstractmethod
    def start(self) -> None:
        """Ask for closed-loop velocity control, with a setpoint of zero.

        Raises:
            RobotError: it could not be sent. This holds for all that follow.
        """

    @abstractmethod
    def command(self, velocity: float) -> None:
        """Send a setpoint in turn/s. It also carries on a start that takes several steps."""

    @abstractmethod
    def idle(self) -> None:
        """Switch the motor off."""

    def stop_now(self) -> None:
        """Switch the motor off by the shortest way of the protocol, the emergency stop: `idle` if none is shorter."""
        self.idle()

    @abstractmethod
    def clear(self) -> None:
        """Forget latched errors; the motor stays off. Called only on a person's order, or after `watchdog_expired`."""

    def output(self, bits: int) -> None:
        """Switch its digital outputs: on those of these bits, off the others of `outputs`. It may be lost on the bus.

        Raises:
            RobotError: it could not be sent, or the protocol has none.
        """
        raise RobotError(str(self.check_output(bits)))

    def ask_serial(self) -> None:
        """Ask for the serial number; the answer comes to `receive`, so that this waits for nothing.

        Raises:
            RobotError: the question could not be sent.
        """

    def poll(self, now: float) -> None:
        """Ask for what the drive does not send by itself. It is called twenty times a second, and waits for nothing.

        Args:
            now: monotonic time, s.

        Raises:
            RobotError: a question could not be sent.
        """

    def _report_on(self, on: bool, at: float) -> None:
        """Take in the drive's report of whether its motor is under control."""
        self.on, self.reported_at = on, at

    def _estimate(self, position: float, velocity: float, at: float) -> None:
        """Take in an encoder's estimate, unless it is not finite."""
        if math.isfinite(position) and math.isfinite(velocity):
            self.position, self.velocity, self.measured = position, velocity, at
        else:
            self._complain(f"its encoder says {position} turn, {velocity} turn/s")

    def _supply(self, voltage: float, at: float) -> None:
        """Take in the voltage of the supply, unless no supply has it."""
        if 0.0 <= voltage <= _MOST_VOLTS:
            self.voltage, self.supplied = voltage, at
        else:
            self._complain(f"its supply says {voltage:g} V")

    def _complain(self, words: str) -> None:
        """Remember the first oddity."""
        self.implausible = self.implausible or words
