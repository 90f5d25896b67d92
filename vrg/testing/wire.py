"""An axis of a motor protocol and its emulated drives in memory: no bus, no threads, and a clock of the test's."""

import math
import random
from collections import deque
from collections.abc import Callable, Sequence
from typing import Self

from msgspec.structs import replace

from vrg.hal.can.axis import MotorState, ProtocolOptions
from vrg.hal.can.frame import CLASSIC_BYTES, EXTENDED_MASK, FD_BYTES, STANDARD_MASK, Filter, Frame
from vrg.hal.can.machine import POLL_PERIOD
from vrg.hal.can.protocols import Protocol
from vrg.hal.can.workshop.emulated import DriveOptions, EmulatedDrive
from vrg.hal.can.workshop.faults import FaultKind, FaultRequest, encode_fault
from vrg.hal.can.workshop.survey import Survey
from vrg.hal.clock import MonotonicClock, Task

SERIAL_NUMBER = 0xBEEF
WAIT_TIMEOUT = 30.0
"""The time on the clock in s within which something that is waited for must happen."""
SETPOINT_PERIOD = 0.02
"""The time in s between setpoints."""
SPEED = 8.0
"""The speed at which motors are tested, turn/s."""
WATCHDOG = 0.2
"""The time in s without a setpoint after which a drive stops its motor."""


class WireClock(MonotonicClock):
    """The clock of a wire: who waits by it lets the time of the wire pass.

    Args:
        wire: has `now` and `advance`.
    """

    def __init__(self, wire: "ProtocolWire") -> None:
        self._wire = wire

    def now(self) -> float:
        """The time of the wire, s."""
        return self._wire.now

    def sleep(self, seconds: float) -> None:
        """Let the time of the wire pass."""
        self._wire.advance(seconds)

    def spawn(self, work: Callable[[], None], name: str) -> Task:
        """Refuse: an axis has no work of its own.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError(f"an axis does not spawn {name}")


class ProtocolWire:
    """An axis, one or more emulated drives that have its id, and a clock.

    What the axis sends is delivered, and answered, before its call returns. Frames of the drives pass the filters of
    the axis once that is prepared.

    Args:
        protocol: the protocol of the axis and the drives. node: their id.
        serials: the serial number of each drive. options: the axis' options of them, which they do not report.

    Attributes:
        now: the clock, monotonic s.
        axis, drives: the two ends of the wire. survey: a listener of the protocol, which hears the drives too.
        sent: the frames that the axis has sent. heard: the frames that the drives have sent.
    """

    def __init__(
        self,
        protocol: Protocol,
        node: int,
        serials: Sequence[int] = (SERIAL_NUMBER,),
        options: ProtocolOptions | None = None,
    ) -> None:
        self.now = 100.0
        self.node = node
        self.sent: list[Frame] = []
        self.heard: list[Frame] = []
        clock = WireClock(self)
        self.axis = protocol.axis_type(node, self.send, clock, options)
        self.drives: list[EmulatedDrive] = [
            protocol.drive_type(
                node,
                DriveOptions(serial=serial, watchdog=WATCHDOG, protocol=options),
                self.now,
                random.Random(serial),
            )
            for serial in serials
        ]
        self.survey = Survey([] if protocol.listener is None else [protocol.listener_type(self.question, clock)])
        self._filters: list[Filter] | None = None
        self._poll_at = math.inf
        self._under_way: deque[Frame] = deque()
        self._pumping = False

    @property
    def drive(self) -> EmulatedDrive:
        """The first drive."""
        return self.drives[0]

    @property
    def motor_speed(self) -> float:
        """The true speed of the first drive's motor, turn/s."""
        return self.drive.motor.velocity

    def says(self) -> tuple[MotorState, str | None]:
        """The state and the fault that the axis tells."""
        return self.axis.state, self.axis.fault

    def send(self, frame: Frame, *, urgent: bool = False) -> None:
        """The axis sends a frame."""
        assert len(frame.data) <= (FD_BYTES if frame.fd else CLASSIC_BYTES)
        assert frame.id <= (EXTENDED_MASK if frame.extended else STANDARD_MASK)
        self.sent.append(frame)
        self.inject(frame)

    def inject(self, frame: Frame) -> None:
        """A frame reaches the drives, and their answers the axis."""
        for drive in self.drives:
            self._under_way.extend(drive.receive(frame, self.now))
        self._pump()

    def question(self, frame: Frame, *, urgent: bool = False) -> None:
        """A listener asks the drives."""
        self.inject(frame)

    def advance(self, seconds: float) -> None:
        """Let time pass without setpoints."""
        until = self.now + seconds
        while self.now < until:
            due = min(drive.due for drive in self.drives)
            self.now = min(until, max(self.now + 1e-4, min(due, self._poll_at)))
            if self.now >= self._poll_at:
                self._poll_at = self.now + POLL_PERIOD
                self.axis.poll(self.now)
            for drive in self.drives:
                self._under_way.extend(drive.step(self.now))
            self._pump()

    def until(self, condition: Callable[[], object], act: Callable[[], object] = lambda: None) -> None:
        """Let time pass until the condition holds; `act` is called every SETPOINT_PERIOD."""
        end = self.now + WAIT_TIMEOUT
        while not condition():
            assert self.now < end, f"it has not come about: {vars(self.axis)}"
            act()
            self.advance(SETPOINT_PERIOD)

    def drive_on(self, velocity: float, seconds: float) -> None:
        """Send setpoints for a while."""
        end = self.now + seconds
        self.until(lambda: self.now >= end, lambda: self.axis.command(velocity))

    def fault(self, kind: FaultKind, duration: float = 0.0, value: int = 0) -> None:
        """Let something go wrong in the drives."""
        self.inject(encode_fault(self.node, FaultRequest(kind, duration, value)))

    def meet(self) -> Self:
        """Let time pass until the axis knows its drive."""
        self.advance(0.01)
        self.until(
            lambda: self.axis.identified and self.axis.heard > 0,
            lambda: self.axis.identified or self.axis.identify(0.5),
        )
        return self

    def prepare(self) -> Self:
        """Let time pass until the drive is set up and its encoder has spoken."""
        self.meet()
        assert self.axis.problem is None
        self.axis.prepare()
        self._filters = self.axis.filters
        self._poll_at = self.now
        self.until(lambda: self.axis.state is MotorState.IDLE and self.axis.measured > 0)
        return self

    def get_going(self, velocity: float = SPEED) -> None:
        """Start, and send setpoints until the motor turns by them."""
        self.axis.start()
        self.until(
            lambda: (
                self.axis.state is MotorState.CLOSED_LOOP and abs(self.axis.velocity - velocity) < 0.1 * abs(velocity)
            ),
            lambda: self.axis.command(velocity),
        )

    def running(self, velocity: float = SPEED) -> Self:
        """Prepare and get going."""
        self.prepare()
        self.get_going(velocity)
        return self

    def _pump(self) -> None:
        if self._pumping:
            return
        self._pumping = True
        try:
            while self._under_way:
                frame = replace(self._under_way.popleft(), at=self.now)
                self.heard.append(frame)
                self.survey.hear(frame)
                if self._passes(frame):
                    self.axis.receive(frame)
        finally:
            self._pumping = False

    def _passes(self, frame: Frame) -> bool:
        if self._filters is None:
            return True
        return any(wanted.passes(frame) for wanted in self._filters)
