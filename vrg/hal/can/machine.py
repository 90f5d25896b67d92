"""The states of a robot's drive train: events in, orders out. It has no clock, no lock, no thread and no bus.

    CLOSED -> MEETING -> MET <-> RECOVERING         a drive train, and whether its drives can be spoken to
                         off -> proving -> on       its motors, while it has met its drives; see vrg.hal.can.guard

Its owner hands in the events, with the monotonic time in s, and carries out the orders that it gets, in their
order. What the drives report is in their `AxisReport`s, which the machine reads. Setpoints follow from a call of the
robot's own thread alone: if that freezes or dies, none is sent, and the drives' own watchdogs stop the motors.
"""

import enum
import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from vrg.errors import RobotError
from vrg.hal.can.axis import NEVER, AxisReport, MotorState
from vrg.hal.can.base import DriveBase, EncoderEstimate
from vrg.hal.can.guard import Guard
from vrg.hal.can.judges.off import OFF_PERIOD
from vrg.hal.can.judges.reasons import BUSY
from vrg.hal.can.judges.start import START_TIMEOUT
from vrg.hal.can.judges.supply import ANY_SUPPLY
from vrg.hal.can.outputs import Output, Outputs
from vrg.hal.can.plausibility import BEGINNING, ENCODER, Plausibility
from vrg.hal.driver import COMMAND_TIMEOUT

log = logging.getLogger(__name__)

TIMES = 2
"""Times that a setpoint is sent. A player has one for a drive in 0.1 s, and a lost one leaves 0.1 s for the next."""
POLL_PERIOD = 0.05
"""s between questions to drives that do not send by themselves. While watchdogs are proved it is half of that."""
LOOK_PERIOD = 0.01
"""s between judgements, while no drive reports anything new but its encoder's estimates."""
WHO_PERIOD = 0.5
"""s from a question for the serial number of one drive to that for the next one's: answers might get mixed up."""
LAG = 0.1
"""s between two times up to which the bus has been heard from which on the receive thread did not run meanwhile."""
BLIND = 0.3
"""s without news of the bus after which the robot is not driven: the receive thread has been kept from running."""
OLD, OLD_TIMEOUT = 0.2, 1.0
"""The age in s from which on a frame is old as it is heard, and the s for which all frames may be old."""


class Phase(enum.Enum):
    """The phases in which the drives can or cannot be commanded."""

    CLOSED = "closed"
    MEETING = "meeting its drives"
    MET = "connected"
    RECOVERING = "being recovered"


class AxisMethod(enum.Enum):
    """An order to an axis: the name of its method."""

    IDLE = "idle"
    STOP_NOW = "stop_now"
    CLEAR = "clear"
    START = "start"
    COMMAND = "command"
    POLL = "poll"
    OUTPUT = "output"
    ASK_SERIAL = "ask_serial"


class Order(NamedTuple):
    """One order to the axis of a node.

    The argument of a COMMAND is a velocity in turn/s, that of a POLL the time in s, that of an OUTPUT the bits.
    """

    act: AxisMethod
    node: int
    arguments: tuple[float, ...] = ()


class StateMachine:
    """The states of one drive train: events come in, and orders go out.

    Args:
        name: the robot's name, for messages. base: its wheels and its odometry.
        supply: the voltages of an empty and a full battery, V; 0 and infinity if they are not known.
        outputs: the actuators at digital outputs of its drives.

    Attributes:
        phase: whether the drives can be spoken to. guard: judges what they report. reports: what they report, by node.
        heard_until: monotonic time up to which all that was on the bus has been heard, s: what waits unread is not
            missing.
    """

    def __init__(
        self,
        name: str,
        base: DriveBase,
        supply: tuple[float, float] = ANY_SUPPLY,
        outputs: Mapping[str, Output] | None = None,
    ) -> None:
        self.name = name
        self.base = base
        self.outputs = Outputs(outputs or {})
        self._supply = supply
        self._complained = ""
        self.begin([])
        self.close()

    def begin(self, reports: Sequence[AxisReport]) -> None:
        """A meeting begins (see vrg.hal.can.meeting), with drives of which nothing has been heard."""
        self.phase = Phase.MEETING
        self.reports = {report.node: report for report in reports}
        self.guard = Guard(reports, self._supply, {axis.node: axis.serial for axis in self.base.axes})
        self.base.restart()
        self.rebind(self.base)
        self.heard_until = self._looked = self._polled = self._ordered = NEVER
        self._asked, self._turn = NEVER, 0
        self._old_since = math.inf
        self._fault_logged: str | None = None
        self._off_logged = True
        self._measured = dict.fromkeys(self.reports, NEVER)
        self._forget_outputs()

    def rebind(self, base: DriveBase) -> None:
        """Wheels and odometry are these from now on, as a calibration has found them."""
        self.base = base
        slowest = {node: report.slowest for node, report in self.reports.items()}
        self._plausibility = {node: Plausibility(own, slowest.get(node, 0.0)) for node, own in base.bounds.items()}

    @property
    def connected(self) -> bool:
        """True if every drive has been met."""
        return self.phase in (Phase.MET, Phase.RECOVERING)

    def bus_silence(self, now: float) -> float:
        """s since the receive thread was last known to keep up with the bus."""
        return now - self.heard_until

    def met(self, now: float) -> None:
        """Every drive has been met and set up."""
        self.guard.begin(now)
        self.phase = Phase.MET

    def close(self) -> None:
        """The bus is closed from now on."""
        self.phase = Phase.CLOSED

    def arm(self, now: float) -> list[Order]:
        """Every axis is to be in closed loop. The first time, the watchdogs of the drives are proved before.

        It is called again and again until all are there.

        Raises:
            RobotError: not connected, a fault has latched, or the emergency stop is engaged.
        """
        if not self.connected:
            raise RobotError("expected a connected robot to arm: call connect() first", self.name)
        refusal = "it is being recovered" if self.phase is Phase.RECOVERING else self.guard.refusal(now)
        if refusal:
            raise RobotError(refusal, self.name)
        if self.guard.armed_by_player:
            # A drive that takes long to start is not left without setpoints meanwhile.
            return [] if self.guard.armed else self.stand(now)
        if not self.guard.off:
            return []  # what a drive reports of before would be taken for its answer
        if self.guard.rearm_pending and not self.guard.proof.pending:
            log.info("%s: the watchdog of every drive has stopped its motor, as it must", self.name)
        self.base.rebase()
        self.guard.arm(now)
        expired = [report for report in self.reports.values() if report.watchdog_expired]
        for report in expired:
            report.watchdog_expired = False
        return [*(Order(AxisMethod.CLEAR, report.node) for report in expired), *self._all(AxisMethod.START)]

    def drive(self, setpoints: Sequence[tuple[int, float]], now: float) -> list[Order]:
        """Setpoints by node, turn/s, are to be sent.

        Raises:
            RobotError: the emergency stop, a fault, not armed, or nothing has been heard of the bus.
        """
        if not all(math.isfinite(velocity) for _, velocity in setpoints):
            raise RobotError(f"expected finite setpoints in turn/s, got {dict(setpoints)}", self.name)
        self._require_armed(now)
        return [*self._command(setpoints, now), *self._switch(now)]

    def use(self, name: str, value: float, now: float) -> list[Order]:
        """An actuator at an output is to be used; nothing happens while motors start, or watchdogs are proved.

        Raises:
            RobotError: as for `drive`.
        """
        self._require_armed(now)
        if self.guard.armed:
            self.outputs.use(name, value, now)
        return self._switch(now)

    def _require_armed(self, now: float) -> None:
        """Raise RobotError unless the robot may be commanded."""
        guard, bus_silence = self.guard, self.bus_silence(now)
        if guard.estop:
            raise RobotError("the emergency stop is engaged: release it, then arm again", self.name)
        if guard.fault:
            raise RobotError(guard.fault, self.name)
        if guard.disarmed_because is not None:
            raise RobotError(f"{guard.disarmed_because} Arm again", self.name)
        if not guard.armed_by_player:
            raise RobotError("expected armed motors to drive, and they are off: arm the robot first", self.name)
        if bus_silence > BLIND:
            raise RobotError(f"nothing has been heard from the bus for {bus_silence:.1f} s", self.name)

    def stand(self, now: float) -> list[Order]:
        """Setpoints of zero are to be sent, if the robot is armed and hears the bus."""
        if not self.connected or not self.guard.armed_by_player or self.bus_silence(now) > BLIND:
            return []
        return self._command([(node, 0.0) for node in self.reports], now)

    def _command(self, setpoints: Sequence[tuple[int, float]], now: float) -> list[Order]:
        if self.guard.withholding or self.guard.rearm_pending:
            return []
        if not self.guard.armed:
            # No wheel turns alone while another one starts, and watchdogs are proved at rest.
            setpoints = [(node, 0.0) for node, _ in setpoints]
        self.guard.start.command(now)
        for node, velocity in setpoints:
            self._plausibility[node].ask(velocity, now)
        return [Order(AxisMethod.COMMAND, node, (velocity,)) for node, velocity in [*setpoints] * TIMES]

    def disarm(self, now: float) -> list[Order]:
        """The motors are to be off until the robot is armed again."""
        self.guard.disarm()
        return self._idle(now) if self.connected else []

    def engage(self) -> list[Order]:
        """The emergency stop of the match was engaged."""
        if not self.connected:
            return []
        self.guard.engage()
        return [*self._all(AxisMethod.STOP_NOW), *self._release()]

    def release(self, now: float) -> list[Order]:
        """A person has released the emergency stop. The motors stay off."""
        if not self.connected or not self.guard.estop:
            return []
        self.guard.release(now)
        return self._all(AxisMethod.CLEAR)

    def recover(self, now: float) -> list[Order] | None:
        """A person wants what has latched to be cleared; None if that cannot be now."""
        if self.phase is not Phase.MET:
            return None
        self.phase = Phase.RECOVERING
        self.guard.disarm()
        return self._idle(now)

    def recovered(self, problem: str | None, now: float) -> list[Order]:
        """The bus was opened again and the drives were set up, or a problem has kept that from being done, in words."""
        if self.phase is not Phase.RECOVERING:
            return []  # it was closed meanwhile
        self.phase = Phase.MET
        self._forget_outputs()
        self._old_since = math.inf
        # What a person needs to know from now on is this, and no longer what was wrong before.
        self.guard.begin(now)
        if problem:
            self.guard.latch(problem)
            return self.look(now)
        log.info("%s: faults are cleared, the motors are off", self.name)
        return [*self._idle(now), *([] if self.guard.estop else self._all(AxisMethod.CLEAR)), *self.look(now)]

    def hear(self, nodes: Iterable[int], until: float, now: float, *, news: bool = True) -> list[Order]:
        """All that was on the bus until then has been heard.

        Args:
            nodes: which drives have sent something since. until: a time that has passed, now: the time that it is, s.
            news: they may have reported more than estimates of their encoders.
        """
        if until - self.heard_until > LAG:
            self.guard.catch_up(until)
        self.heard_until = max(self.heard_until, until)
        for node in nodes:
            self._estimate(node)
        if self.phase is Phase.RECOVERING and not self.guard.off and now - self._ordered >= OFF_PERIOD:
            return self._idle(now)  # the order may have been lost on the bus
        if self.phase is not Phase.MET:
            return []
        self._judge_age(now - until, now)
        orders = [*self._poll(now), *self._switch(now)]
        if news or self.guard.fault != self._fault_logged or now - self._looked >= LOOK_PERIOD:
            orders += self.look(now)
        return orders

    def _judge_age(self, age: float, now: float) -> None:
        """Latch if all that is heard has been old for long."""
        self._old_since = min(self._old_since, now) if age > OLD else math.inf
        if now - self._old_since > OLD_TIMEOUT:
            self.guard.latch(
                f"what is heard from the bus is {age:.2g} s old: this computer is too busy, or its CAN adapter too "
                "slow. Close other programs, or use another adapter (docs/hardware.md)"
            )

    def _estimate(self, node: int) -> None:
        """Compare what an encoder has reported, if it has, with what its motor was asked for."""
        report, guard = self.reports[node], self.guard
        if report.measured == self._measured[node]:
            return
        gap, self._measured[node] = report.measured - self._measured[node], report.measured
        estimate = EncoderEstimate(report.position, report.velocity, report.measured)
        way = self.base.update(node, estimate, report.wrap)
        if way is None and (guard.armed or guard.disarmed_because is not None):
            where = f"node {node}: its position jumped to {report.position:.4g} turns"
            again = gap > LAG and abs(report.position) < BEGINNING
            guard.latch(f"{where}: {'was the drive started again?' if again else ENCODER}")
        # Without setpoints a motor stops, as it must.
        fresh = report.measured - guard.start.commanded_at <= COMMAND_TIMEOUT
        driven = guard.armed_by_player and report.state is MotorState.CLOSED_LOOP and fresh
        others = [own.turns for other, own in self._plausibility.items() if other != node]
        alone = bool(others) and all(others)
        problem = self._plausibility[node].judge(report.velocity, way, report.measured, driven=driven, alone=alone)
        if problem:
            guard.latch(f"node {node}: {problem}")

    def _poll(self, now: float) -> list[Order]:
        """Ask the drives for what they do not send by themselves, if it is time."""
        period = POLL_PERIOD / 2 if self.guard.withholding else POLL_PERIOD
        if now - self._polled < period:
            return []
        self._polled = now
        self._switched.clear()  # what was sent may be lost
        orders = self._all(AxisMethod.POLL, now)
        node = self.guard.unknown
        if node is None and now - self._asked >= WHO_PERIOD:
            self._asked = now
            self._turn += 1
            node = [*self.reports][self._turn % len(self.reports)]
        return orders if node is None else [*orders, Order(AxisMethod.ASK_SERIAL, node)]

    def look(self, now: float) -> list[Order]:
        """Judge; what is wrong, and that the drives have reported that they are off, is logged once.

        Drives that are met again are judged once that is over: until then they may have nothing to report to.
        """
        if self.phase is not Phase.MET:
            return []
        self._looked = now
        guard, off = self.guard, False
        if self._is_late(now):
            guard.disarm(f"its motors were switched off, as no setpoint came for {COMMAND_TIMEOUT:g} s: {BUSY}")
            off = True
            guard.ordered_off(self.heard_until)
        off |= guard.look(self.heard_until)
        # Where the bus is not heard any more, the order is repeated anyway.
        again = self.bus_silence(now) > BLIND and now - self._ordered >= BLIND
        off |= again and not guard.armed_by_player and not guard.off
        orders = self._idle(now) if off else []
        if guard.fault != self._fault_logged:
            self._fault_logged, self._off_logged = guard.fault, False
            if self._fault_logged:
                log.error("%s: %s: its motors stay off until it is recovered", self.name, self._fault_logged)
        if self._fault_logged and not self._off_logged and guard.off:
            self._off_logged = True
            log.warning("%s: every drive says that its motor is off", self.name)
        return orders

    def _is_late(self, now: float) -> bool:
        """True if the robot's own thread sends no setpoints to motors that may turn. The first one may take long.

        Where the bus was not heard, the drives have judged this themselves, and what they say of it waits to be read.
        """
        guard, start = self.guard, self.guard.start
        since = start.commanded_at if start.commanded_at > start.armed_at else start.armed_at + START_TIMEOUT
        late = now - since > COMMAND_TIMEOUT and self.bus_silence(now) <= BLIND
        return guard.armed_by_player and not guard.proving and late

    def trouble(self, words: str, now: float) -> list[Order]:
        """Something is wrong with the bus."""
        self.guard.latch(words)
        return self.look(now)

    def failed(self, act: AxisMethod, words: str) -> None:
        """An order could not be carried out."""
        if act is AxisMethod.ASK_SERIAL:
            # Nothing waits for the answer but a robot that is not armed yet: the same drive is asked again.
            self._asked, self._turn = NEVER, self._turn - 1
            return
        text = f"{act.value.replace('_', ' ')}: {words}"
        if act not in (AxisMethod.COMMAND, AxisMethod.POLL) and text != self._complained:
            self._complained = text  # a player that is stopped asks again at every tick
            log.warning("%s: %s", self.name, text)
        self.guard.latch(words)

    def _idle(self, now: float) -> list[Order]:
        """Switch every motor off. The match's emergency stop has a shorter way to do so than the others."""
        self._ordered = now
        self.guard.ordered_off(self.heard_until)
        act = AxisMethod.STOP_NOW if self.guard.estop and not self.guard.at_drive else AxisMethod.IDLE
        return [*self._all(act), *self._release()]

    def _switch(self, now: float) -> list[Order]:
        """Switch the outputs, where that was not sent since the last poll."""
        news = {node: on for node, on in self.outputs.bits(now).items() if self._switched.get(node) != on}
        self._switched |= news
        return [Order(AxisMethod.OUTPUT, node, (on,)) for node, on in news.items()]

    def _release(self) -> list[Order]:
        """Switch off the outputs that do not stay on until they are switched off."""
        self.outputs.release()
        return self._switch(NEVER)

    def _forget_outputs(self) -> None:
        """The outputs are off, as drives that were set up have switched them off."""
        self.outputs.reset()
        self._switched: dict[int, int] = {}

    def _all(self, act: AxisMethod, *arguments: float) -> list[Order]:
        return [Order(act, node, arguments) for node in self.reports]
