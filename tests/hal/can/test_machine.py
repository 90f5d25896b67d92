"""The states of a drive train, by events and orders: no axis, no bus, no clock and no thread."""

import math
from collections.abc import Iterable, Sequence

import pytest

from vrg.errors import RobotError
from vrg.hal.can.axis import AxisReport, MotorState
from vrg.hal.can.base import DriveBase, WheelAxis
from vrg.hal.can.judges.proof import PROOF_TIMEOUT
from vrg.hal.can.machine import (
    BLIND,
    OLD,
    OLD_TIMEOUT,
    POLL_PERIOD,
    TIMES,
    WHO_PERIOD,
    AxisMethod,
    Order,
    Phase,
    StateMachine,
)
from vrg.hal.can.meeting import ANSWERS_SETTLE, HEAR_TIMEOUT, LISTEN, Meeting, MeetingStep, MissingError
from vrg.hal.can.plausibility import FOLLOWING_TIMEOUT, STALL_TIMEOUT
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.hal.models import robot_model

NODES = (1, 2)
AXES = [WheelAxis(1, 0, ratio=50.0), WheelAxis(2, 1, ratio=50.0)]


class Bench:
    """A machine, the reports of two drives, and what somebody who carries out its orders would tell of time."""

    def __init__(self, axes: Iterable[WheelAxis] = AXES) -> None:
        self.now = 100.0
        wired = list(axes)
        self.reports = [AxisReport(axis.node) for axis in wired]
        self.machine = StateMachine("r", DriveBase(wired, robot_model("P2AT")))
        self.machine.begin(self.reports)
        self.meeting = Meeting("toy", self.reports, self.now)

    def report(self, state: MotorState, *, on: bool, age: float = 0.0) -> list[Order]:
        """Both drives report, and the machine hears it."""
        for report in self.reports:
            report.state, report.on = state, on
            report.heard = report.reported_at = report.measured = self.now - age
        return self.machine.hear([*self.machine.reports], self.now - age, self.now)

    def pass_time(
        self, seconds: float, state: MotorState = MotorState.IDLE, *, on: bool = False, age: float = 0.0
    ) -> set[AxisMethod]:
        """Let time pass while both drives report; what is ordered meanwhile, but for questions."""
        end, acts = self.now + seconds, set[AxisMethod]()
        while self.now < end:
            self.now += 0.01
            acts |= {order.act for order in self.report(state, on=on, age=age)}
        return acts - {AxisMethod.POLL}

    def met(self) -> "Bench":
        """All drives are met."""
        self.report(MotorState.IDLE, on=False)
        self.machine.met(self.now)
        self.pass_time(0.1)
        return self

    def armed(self) -> "Bench":
        """The robot is armed, and its drives were seen to have watchdogs."""
        self.met().machine.guard.proof.pending = False
        self.machine.arm(self.now)
        self.pass_time(0.05, MotorState.CLOSED_LOOP, on=True)
        assert self.machine.guard.armed
        return self


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def met(bench: Bench) -> Bench:
    return bench.met()


@pytest.fixture
def armed(bench: Bench) -> Bench:
    return bench.armed()


def acts(orders: Sequence[Order]) -> list[AxisMethod]:
    return [order.act for order in orders]


class TestMeeting:
    def test_it_listens_asks_settles_and_sets_up(self, bench: Bench) -> None:
        meeting, reports = bench.meeting, bench.reports
        assert meeting.step(bench.now) is MeetingStep.WAIT
        bench.now += LISTEN
        assert meeting.step(bench.now) is MeetingStep.ASK
        assert meeting.step(bench.now + 0.1) is MeetingStep.WAIT
        for report in reports:
            report.heard = bench.now
        assert meeting.step(bench.now) is MeetingStep.WAIT
        assert meeting.step(bench.now + ANSWERS_SETTLE) is MeetingStep.SET_UP
        assert bench.machine.phase is Phase.MEETING

    def test_one_that_says_nothing_is_named(self, bench: Bench) -> None:
        bench.reports[0].heard = bench.now
        for _ in range(2):
            bench.now += max(LISTEN, HEAR_TIMEOUT) - 0.01
            bench.meeting.step(bench.now)
        with pytest.raises(MissingError, match=r"^a heartbeat of toy node 2$"):
            bench.meeting.step(bench.now + 0.02)

    def test_drives_that_somebody_else_commands_are_asked_nothing(self, bench: Bench) -> None:
        bench.reports[1].implausible = "another program commands it too"
        with pytest.raises(RobotError, match="node 2: another program"):
            bench.meeting.step(bench.now + LISTEN)

    def test_nothing_is_ordered_before_all_are_met(self, bench: Bench) -> None:
        machine = bench.machine
        assert bench.report(MotorState.CLOSED_LOOP, on=True) == []
        assert machine.disarm(bench.now) == machine.engage() == machine.release(bench.now) == []
        assert machine.recover(bench.now) is None
        with pytest.raises(RobotError, match="expected a connected robot"):
            machine.arm(bench.now)


class TestMotors:
    @pytest.mark.parametrize("velocity", [math.nan, math.inf, -math.inf])
    def test_a_setpoint_that_is_not_finite_is_refused(self, armed: Bench, velocity: float) -> None:
        with pytest.raises(RobotError, match="finite setpoints"):
            armed.machine.drive([(1, 1.0), (2, velocity)], armed.now)

    def test_a_start_is_an_order_to_each_axis(self, met: Bench) -> None:
        met.reports[1].watchdog_expired = True
        assert met.machine.arm(met.now) == [
            Order(AxisMethod.CLEAR, 2),
            Order(AxisMethod.START, 1),
            Order(AxisMethod.START, 2),
        ]

    def test_setpoints_are_sent_twice(self, bench: Bench) -> None:
        orders = bench.armed().machine.drive([(1, 3.0), (2, 4.0)], bench.now)
        assert orders == [Order(AxisMethod.COMMAND, 1, (3.0,)), Order(AxisMethod.COMMAND, 2, (4.0,))] * TIMES

    def test_nothing_drives_that_is_not_armed(self, bench: Bench) -> None:
        with pytest.raises(RobotError, match="expected armed motors to drive, and they are off: arm the robot first"):
            bench.met().machine.drive([(1, 3.0)], bench.now)

    def test_no_wheel_turns_while_another_one_starts(self, bench: Bench) -> None:
        bench.met().machine.guard.proof.pending = False
        bench.machine.arm(bench.now)
        bench.reports[0].state = MotorState.CLOSED_LOOP
        assert {order.arguments for order in bench.machine.drive([(1, 3.0), (2, 3.0)], bench.now)} == {(0.0,)}

    def test_nobody_drives_blind(self, armed: Bench) -> None:
        with pytest.raises(RobotError, match=r"nothing has been heard from the bus for 0\.4 s"):
            armed.machine.drive([(1, 3.0)], armed.now + BLIND + 0.1)
        assert armed.machine.stand(armed.now + BLIND + 0.1) == []

    def test_a_player_that_sends_nothing_is_late(self, armed: Bench) -> None:
        armed.machine.drive([(1, 0.0), (2, 0.0)], armed.now)
        assert AxisMethod.IDLE in armed.pass_time(COMMAND_TIMEOUT + 0.05, MotorState.CLOSED_LOOP, on=True)
        with pytest.raises(RobotError, match=r"no setpoint came .*Arm again"):
            armed.machine.drive([(1, 1.0)], armed.now)

    def test_it_is_armed_again_once_every_drive_has_reported_that_it_is_off(self, armed: Bench) -> None:
        """A report that is under way when the motors are switched off still says that they are on."""
        armed.machine.drive([(1, 0.0), (2, 0.0)], armed.now)
        armed.pass_time(COMMAND_TIMEOUT + 0.05, MotorState.CLOSED_LOOP, on=True)
        assert not armed.machine.guard.armed_by_player
        assert armed.machine.arm(armed.now) == []
        armed.pass_time(0.05)
        assert acts(armed.machine.arm(armed.now)) == [AxisMethod.START] * 2
        assert armed.machine.guard.fault is None

    def test_the_emergency_stop_has_the_shortest_way(self, armed: Bench) -> None:
        assert acts(armed.machine.engage()) == [AxisMethod.STOP_NOW] * 2
        armed.pass_time(0.3)
        with pytest.raises(RobotError, match="the emergency stop is engaged"):
            armed.machine.drive([(1, 1.0)], armed.now)
        assert acts(armed.machine.release(armed.now)) == [AxisMethod.CLEAR] * 2

    def test_an_order_that_cannot_be_sent_latches(self, armed: Bench) -> None:
        armed.machine.failed(AxisMethod.COMMAND, "the bus is full")
        assert acts(armed.machine.look(armed.now)) == [AxisMethod.IDLE] * 2
        assert armed.machine.guard.fault == "the bus is full"

    def test_watchdogs_are_asked_for_more_often_while_they_are_proved(self, met: Bench) -> None:
        met.machine.arm(met.now)
        met.pass_time(0.05, MotorState.CLOSED_LOOP, on=True)
        assert met.machine.guard.withholding
        polls = 0
        for _ in range(10):
            met.now += POLL_PERIOD / 2 + 1e-6
            polls += AxisMethod.POLL in acts(met.report(MotorState.CLOSED_LOOP, on=True))
        assert polls == 10
        assert met.machine.stand(met.now) == [], "nothing feeds them"

    def test_a_watchdog_that_was_not_proved_is_tried_again_once_the_motors_are_off(self, met: Bench) -> None:
        met.machine.arm(met.now)
        assert AxisMethod.IDLE in met.pass_time(PROOF_TIMEOUT + 0.1, MotorState.CLOSED_LOOP, on=True)
        assert met.machine.arm(met.now) == []
        met.pass_time(0.05)
        assert acts(met.machine.arm(met.now)) == [AxisMethod.START] * 2
        assert met.machine.guard.fault is None


class TestWhatIsHeard:
    def test_after_a_recovery_the_age_of_what_is_heard_is_judged_anew(self, met: Bench) -> None:
        met.pass_time(2 * OLD_TIMEOUT, age=OLD + 0.1)
        assert met.machine.guard.fault is not None
        met.machine.recover(met.now)
        met.now += 1.0
        met.machine.recovered(None, met.now)
        met.pass_time(0.1, age=OLD + 0.1)
        assert met.machine.guard.fault is None

    def test_frames_that_are_always_old_are_a_fault_with_what_to_do(self, met: Bench) -> None:
        met.pass_time(OLD_TIMEOUT / 2, age=OLD + 0.1)
        met.pass_time(0.05)
        met.pass_time(OLD_TIMEOUT - 0.1, age=OLD + 0.1)
        assert met.machine.guard.fault is None, "a process that was kept from running finds old frames for a moment"
        met.pass_time(0.3, age=OLD + 0.1)
        assert met.machine.guard.fault == (
            "what is heard from the bus is 0.3 s old: this computer is too busy, or its CAN adapter too slow. Close "
            "other programs, or use another adapter (docs/hardware.md)"
        )

    def test_drives_are_asked_in_turns_who_they_are(self, met: Bench) -> None:
        asked = []
        for _ in range(50):
            met.now += POLL_PERIOD
            asked += [o.node for o in met.report(MotorState.IDLE, on=False) if o.act is AxisMethod.ASK_SERIAL]
        assert asked[:4] in ([1, 2, 1, 2], [2, 1, 2, 1])

    def test_one_that_could_not_be_asked_who_it_is_is_asked_again(self, met: Bench) -> None:
        asked, failures = [], 3
        for _ in range(50):
            met.now += POLL_PERIOD
            for order in met.report(MotorState.IDLE, on=False):
                if order.act is AxisMethod.ASK_SERIAL:
                    asked.append((order.node, met.now))
                    if len(asked) <= failures:
                        met.machine.failed(order.act, "the transmit queue is full")
        assert met.machine.guard.fault is None
        nodes, times = zip(*asked, strict=True)
        assert nodes[: failures + 2] in ((1, 1, 1, 1, 2), (2, 2, 2, 2, 1))
        assert times[failures] - times[0] < WHO_PERIOD, "at once, and not when it would be its turn"

    def test_estimates_alone_are_judged_now_and_then(self, armed: Bench) -> None:
        armed.reports[0].implausible = "rubbish"
        assert armed.machine.hear([1], armed.now, armed.now, news=False) == []
        assert AxisMethod.IDLE in acts(armed.machine.hear([1], armed.now, armed.now + 0.02, news=False))

    def test_an_estimate_that_cannot_be_switches_off_at_once(self, armed: Bench) -> None:
        armed.reports[0].velocity, armed.reports[0].measured = 1e6, armed.now + 0.001
        assert acts(armed.machine.hear([1], armed.now + 0.001, armed.now + 0.001, news=False)) == [AxisMethod.IDLE] * 2
        assert "its encoder says 1e+06 turn/s" in (armed.machine.guard.fault or "")


class TestFourWheels:
    """A robot that turns where one of its wheels stands, and one that pushes where all do but one that slips."""

    @pytest.mark.parametrize(("turning", "stand"), [((1,), STALL_TIMEOUT), ((1, 2, 3), FOLLOWING_TIMEOUT)])
    def test_a_wheel_that_stands_has_less_time_only_if_all_others_turn(
        self, turning: tuple[int, ...], stand: float
    ) -> None:
        bench = Bench(WheelAxis(n, (n - 1) // 2, ratio=50.0) for n in (1, 2, 3, 4))
        bench.armed()
        asked, began, latched = 20.0, math.inf, 0.0
        while not latched and bench.now < began + 3.0:
            bench.machine.drive([(report.node, asked) for report in bench.reports], bench.now)
            began = min(began, bench.now)
            bench.now += 0.01
            for report in bench.reports:
                report.velocity = asked if report.node in turning else 0.0
                report.position += 0.01 * report.velocity
            bench.report(MotorState.CLOSED_LOOP, on=True)
            if bench.machine.guard.fault:
                latched = bench.now
        assert "it stands still, though asked for 20 turn/s" in (bench.machine.guard.fault or "")
        assert stand < latched - began < stand + 0.5


class TestRecovery:
    def test_it_clears_what_has_latched_and_leaves_the_motors_off(self, armed: Bench) -> None:
        armed.machine.trouble("the interface is down", armed.now)
        assert acts(armed.machine.recover(armed.now) or []) == [AxisMethod.IDLE] * 2
        assert armed.machine.recover(armed.now) is None, "once at a time"
        with pytest.raises(RobotError, match="it is being recovered"):
            armed.machine.arm(armed.now)
        assert set(acts(armed.machine.recovered(None, armed.now))) == {AxisMethod.IDLE, AxisMethod.CLEAR}
        assert armed.machine.guard.fault is None
        assert not armed.machine.guard.armed_by_player

    def test_what_still_is_wrong_latches(self, met: Bench) -> None:
        met.machine.recover(met.now)
        met.machine.recovered("the interface is gone", met.now)
        assert met.machine.guard.fault == "the interface is gone"
        assert met.machine.phase is Phase.MET

    def test_one_that_was_closed_meanwhile_stays_closed(self, met: Bench) -> None:
        met.machine.recover(met.now)
        met.machine.close()
        assert met.machine.recovered(None, met.now) == []
        assert met.machine.phase is Phase.CLOSED
