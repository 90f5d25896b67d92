"""The states of a drive train, by events and orders: no axis, no bus, no clock and no thread."""

import math
from collections.abc import Sequence

import pytest

from vrg.errors import RobotError
from vrg.hal.can.axis import AxisReport, MotorState
from vrg.hal.can.base import DriveBase, WheelAxis
from vrg.hal.can.guard import PROOF_TIMEOUT
from vrg.hal.can.machine import BLIND, OLD, OLD_TIMEOUT, POLL_PERIOD, TIMES, AxisMethod, Order, Phase, StateMachine
from vrg.hal.can.meeting import ANSWERS_SETTLE, HEAR_TIMEOUT, LISTEN, Meeting, MeetingStep, MissingError
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.hal.models import robot_model

NODES = (1, 2)
AXES = [WheelAxis(1, 0, ratio=50.0), WheelAxis(2, 1, ratio=50.0)]


class Bench:
    """A machine, the reports of two drives, and what somebody who carries out its orders would tell of time."""

    def __init__(self) -> None:
        self.now = 100.0
        self.reports = [AxisReport(node) for node in NODES]
        self.machine = StateMachine("r", DriveBase(AXES, robot_model("P2AT")))
        self.machine.begin(self.reports)
        self.meeting = Meeting("toy", self.reports, self.now)

    def report(self, state: MotorState, *, on: bool, age: float = 0.0) -> list[Order]:
        """Both drives report, and the machine hears it."""
        for report in self.reports:
            report.state, report.on = state, on
            report.heard = report.told = report.measured = self.now - age
        return self.machine.hear(NODES, self.now - age, self.now)

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
        self.met().machine.guard.unproved = False
        self.machine.arm(self.now)
        self.pass_time(0.05, MotorState.CLOSED_LOOP, on=True)
        assert self.machine.guard.armed
        return self


@pytest.fixture
def bench() -> Bench:
    return Bench()


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
        bench.reports[1].odd = "another program commands it too"
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
    def test_a_setpoint_that_is_not_finite_is_refused(self, bench: Bench, velocity: float) -> None:
        machine = bench.armed().machine
        with pytest.raises(RobotError, match="finite setpoints"):
            machine.drive([(1, 1.0), (2, velocity)], bench.now)

    def test_a_start_is_an_order_to_each_axis(self, bench: Bench) -> None:
        machine = bench.met().machine
        bench.reports[1].starved = True
        assert machine.arm(bench.now) == [
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

    def test_nobody_drives_blind(self, bench: Bench) -> None:
        machine = bench.armed().machine
        with pytest.raises(RobotError, match=r"nothing has been heard of the bus for 0\.4 s"):
            machine.drive([(1, 3.0)], bench.now + BLIND + 0.1)
        assert machine.stand(bench.now + BLIND + 0.1) == []

    def test_a_player_that_sends_nothing_is_late(self, bench: Bench) -> None:
        machine = bench.armed().machine
        machine.drive([(1, 0.0), (2, 0.0)], bench.now)
        assert AxisMethod.IDLE in bench.pass_time(COMMAND_TIMEOUT + 0.05, MotorState.CLOSED_LOOP, on=True)
        with pytest.raises(RobotError, match=r"no setpoint came .*Arm again"):
            machine.drive([(1, 1.0)], bench.now)

    def test_the_emergency_stop_has_the_shortest_way(self, bench: Bench) -> None:
        machine = bench.armed().machine
        assert acts(machine.engage()) == [AxisMethod.STOP_NOW] * 2
        bench.pass_time(0.3)
        with pytest.raises(RobotError, match="the emergency stop is engaged"):
            machine.drive([(1, 1.0)], bench.now)
        assert acts(machine.release(bench.now)) == [AxisMethod.CLEAR] * 2

    def test_an_order_that_cannot_be_sent_latches(self, bench: Bench) -> None:
        machine = bench.armed().machine
        machine.failed(AxisMethod.COMMAND, "the bus is full")
        assert acts(machine.look(bench.now)) == [AxisMethod.IDLE] * 2
        assert machine.guard.fault == "the bus is full"

    def test_watchdogs_are_asked_for_more_often_while_they_are_proved(self, bench: Bench) -> None:
        machine = bench.met().machine
        machine.arm(bench.now)
        bench.pass_time(0.05, MotorState.CLOSED_LOOP, on=True)
        assert machine.guard.withholding
        polls = 0
        for _ in range(10):
            bench.now += POLL_PERIOD / 2 + 1e-6
            polls += AxisMethod.POLL in acts(bench.report(MotorState.CLOSED_LOOP, on=True))
        assert polls == 10
        assert machine.stand(bench.now) == [], "nothing feeds them"

    def test_a_watchdog_that_was_not_proved_is_tried_again_once_the_motors_are_off(self, bench: Bench) -> None:
        machine = bench.met().machine
        machine.arm(bench.now)
        assert AxisMethod.IDLE in bench.pass_time(PROOF_TIMEOUT + 0.1, MotorState.CLOSED_LOOP, on=True)
        assert machine.arm(bench.now) == []
        bench.pass_time(0.05)
        assert acts(machine.arm(bench.now)) == [AxisMethod.START] * 2
        assert machine.guard.fault is None


class TestWhatIsHeard:
    def test_after_a_recovery_the_age_of_what_is_heard_is_judged_anew(self, bench: Bench) -> None:
        machine = bench.met().machine
        bench.pass_time(2 * OLD_TIMEOUT, age=OLD + 0.1)
        assert machine.guard.fault is not None
        machine.recover(bench.now)
        bench.now += 1.0
        machine.recovered(None, bench.now)
        bench.pass_time(0.1, age=OLD + 0.1)
        assert machine.guard.fault is None

    def test_frames_that_are_always_old_are_a_fault_with_what_to_do(self, bench: Bench) -> None:
        machine = bench.met().machine
        bench.pass_time(OLD_TIMEOUT / 2, age=OLD + 0.1)
        bench.pass_time(0.05)
        bench.pass_time(OLD_TIMEOUT - 0.1, age=OLD + 0.1)
        assert machine.guard.fault is None, "a process that was kept from running finds old frames for a moment"
        bench.pass_time(0.3, age=OLD + 0.1)
        assert machine.guard.fault == (
            "what is heard of the bus is 0.3 s old: this computer is too busy, or its CAN adapter too slow. Close "
            "other programs, or use another adapter (docs/hardware.md)"
        )

    def test_estimates_alone_are_judged_now_and_then(self, bench: Bench) -> None:
        machine = bench.armed().machine
        bench.reports[0].odd = "rubbish"
        assert machine.hear([1], bench.now, bench.now, news=False) == []
        assert AxisMethod.IDLE in acts(machine.hear([1], bench.now, bench.now + 0.02, news=False))

    def test_an_estimate_that_cannot_be_switches_off_at_once(self, bench: Bench) -> None:
        machine = bench.armed().machine
        bench.reports[0].velocity, bench.reports[0].measured = 1e6, bench.now + 0.001
        assert acts(machine.hear([1], bench.now + 0.001, bench.now + 0.001, news=False)) == [AxisMethod.IDLE] * 2
        assert "its encoder says 1e+06 turn/s" in (machine.guard.fault or "")


class TestRecovery:
    def test_it_clears_what_has_latched_and_leaves_the_motors_off(self, bench: Bench) -> None:
        machine = bench.armed().machine
        machine.trouble("the interface is down", bench.now)
        assert acts(machine.recover(bench.now) or []) == [AxisMethod.IDLE] * 2
        assert machine.recover(bench.now) is None, "once at a time"
        with pytest.raises(RobotError, match="it is being recovered"):
            machine.arm(bench.now)
        assert set(acts(machine.recovered(None, bench.now))) == {AxisMethod.IDLE, AxisMethod.CLEAR}
        assert machine.guard.fault is None
        assert not machine.guard.wanted

    def test_what_still_is_wrong_latches(self, bench: Bench) -> None:
        machine = bench.met().machine
        machine.recover(bench.now)
        machine.recovered("the interface is gone", bench.now)
        assert machine.guard.fault == "the interface is gone"
        assert machine.phase is Phase.MET

    def test_one_that_was_closed_meanwhile_stays_closed(self, bench: Bench) -> None:
        machine = bench.met().machine
        machine.recover(bench.now)
        machine.close()
        assert machine.recovered(None, bench.now) == []
        assert machine.phase is Phase.CLOSED
