"""Actuators at digital outputs, by times alone: no axis, no bus and no clock."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import RobotError
from vrg.hal.can.axis import AxisReport, MotorState
from vrg.hal.can.base import DriveBase, WheelAxis
from vrg.hal.can.machine import POLL_PERIOD, AxisMethod, Order, StateMachine
from vrg.hal.can.outputs import Output, Outputs
from vrg.hal.models import robot_model

KICKER, GRIPPER = Output(1, 16, 0.01, 0.5), Output(2, 17, math.inf)
WIRED = {"kicker": KICKER, "gripper": GRIPPER, "dribbler": Output(2, 18, 0.2)}


def on(outputs: Outputs, now: float) -> list[str]:
    bits = outputs.bits(now)
    return [name for name, output in outputs.wired.items() if bits[output.node] >> output.bit & 1]


@given(st.floats(0.0, 1e5), st.floats(0.0, 1.0))
def test_a_pulse_lasts_as_long_as_it_says_and_then_pauses(start: float, later: float) -> None:
    outputs = Outputs(WIRED)
    outputs.use("kicker", 4.0, start)
    assert on(outputs, start + later) == (["kicker"] if start + later < start + 0.01 else [])
    outputs.use("kicker", 4.0, start + later)
    assert ("kicker" in on(outputs, start + later)) == (start + later < start + 0.01 or start + later >= start + 0.5)


def test_a_later_command_without_a_kick_does_not_cut_the_kick_but_stops_a_dribbler() -> None:
    outputs = Outputs(WIRED)
    for name in ("kicker", "dribbler"):
        outputs.use(name, 1.0, 0.0)
        outputs.use(name, 0.0, 0.005)
    assert on(outputs, 0.005) == ["kicker"]
    assert on(outputs, 0.011) == []


def test_a_release_leaves_a_gripper_closed_and_a_reset_opens_it() -> None:
    outputs = Outputs(WIRED)
    for name in WIRED:
        outputs.use(name, 1.0, 0.0)
    assert on(outputs, 0.0) == ["kicker", "gripper", "dribbler"]
    assert on(outputs, 0.1) == ["gripper", "dribbler"]
    outputs.release()
    assert on(outputs, 0.1) == on(outputs, 1e9) == ["gripper"]
    outputs.use("gripper", 0.0, 0.2)
    assert on(outputs, 0.2) == []
    outputs.use("gripper", 1.0, 0.2)
    outputs.reset()
    assert on(outputs, 0.2) == []
    assert outputs.masks == {1: 1 << 16, 2: 3 << 17}


class Bench:
    """A machine whose drives do what they are told."""

    def __init__(self) -> None:
        axes = [WheelAxis(1, 0), WheelAxis(2, 1)]
        self.reports, self.now, self.on = [AxisReport(1), AxisReport(2)], 100.0, False
        self.machine = StateMachine("r", DriveBase(axes, robot_model("P2AT")), outputs=WIRED)
        self.machine.begin(self.reports)
        for report in self.reports:
            report.unwatched = True
        self.machine.met(self.now)
        self.step()

    def step(self, seconds: float = 0.01) -> list[Order]:
        """Let time pass while the drives report; what is ordered at the outputs."""
        self.now += seconds
        for report in self.reports:
            report.state, report.on = MotorState.CLOSED_LOOP if self.on else MotorState.IDLE, self.on
            report.heard = report.reported_at = report.measured = self.now
        orders = self.machine.hear([1, 2], self.now, self.now)
        return [order for order in orders if order.act is AxisMethod.OUTPUT]

    def armed(self) -> "Bench":
        self.machine.arm(self.now)
        self.on = True
        for _ in range(30):
            self.machine.drive([(1, 0.0), (2, 0.0)], self.now)
            self.step()
        assert self.machine.guard.armed
        return self


def orders(*bits: tuple[int, int]) -> list[Order]:
    return [Order(AxisMethod.OUTPUT, node, (on,)) for node, on in bits]


def test_an_output_is_sent_at_once_and_again_at_each_poll_and_off_when_its_time_is_over() -> None:
    bench = Bench().armed()
    assert bench.machine.use("kicker", 4.0, bench.now) == orders((1, 1 << 16))
    found = [bench.step(0.006) for _ in range(20)]
    assert orders((1, 0))[0] in found[1]
    again = [order for step in found[2:] for order in step]
    assert set(again) == set(orders((1, 0), (2, 0)))
    assert len(again) == 2 * round(18 * 0.006 / POLL_PERIOD)


@pytest.mark.parametrize("stop", ["disarm", "engage"])
def test_a_stop_switches_off_at_once_all_but_the_gripper(stop: str) -> None:
    bench = Bench().armed()
    for name in WIRED:
        bench.machine.use(name, 1.0, bench.now)
    found = bench.machine.disarm(bench.now) if stop == "disarm" else bench.machine.engage()
    assert [order for order in found if order.act is AxisMethod.OUTPUT] == orders((1, 0), (2, 1 << 17))


def test_nothing_is_used_before_all_motors_are_on() -> None:
    bench = Bench()
    with pytest.raises(RobotError, match="arm the robot first"):
        bench.machine.use("kicker", 4.0, bench.now)
    bench.machine.arm(bench.now)
    assert not [order for order in bench.machine.use("kicker", 4.0, bench.now) if order.arguments != (0,)]
