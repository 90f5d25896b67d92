"""The judgement over all axes of a robot, by frames and times."""

import math
from collections.abc import Callable

import pytest

from tests.hal.can.odrive.wire import CLOSED, IDLE, Wire
from vrg.hal.can.frame import Frame
from vrg.hal.can.guard import GRACE, HEARTBEAT_TIMEOUT, START_TIMEOUT, Guard
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.odrive.axis import OdriveAxis
from vrg.hal.can.odrive.messages import AxisError, Command


class Pair:
    """Two axes under a guard; `now` is monotonic time."""

    def __init__(self) -> None:
        self.wires = [Wire(0), Wire(1)]
        self.guard = Guard([wire.axis for wire in self.wires])
        self.now = 100.0
        self.beat()
        self.guard.begin(self.now)

    def beat(self, *states: int, error: int = 0) -> None:
        for wire, state in zip(self.wires, states or (IDLE, IDLE), strict=True):
            wire.beat(state, error, self.now)

    def pass_time(self, seconds: float, *states: int) -> bool:
        """Beat on; whether the motors had to be switched off."""
        end = self.now + seconds
        off = False
        while self.now < end:
            self.now += 0.05
            self.beat(*states)
            off |= self.guard.look(self.now)
        return off

    def arm(self) -> None:
        assert self.guard.refusal(self.now) is None
        self.guard.arm(self.now)
        for wire in self.wires:
            wire.axis.start()
        self.pass_time(0.1, CLOSED, CLOSED)
        assert self.guard.armed


@pytest.fixture
def pair() -> Pair:
    return Pair()


def fault_of(pair: Pair) -> str:
    assert pair.guard.fault is not None
    return pair.guard.fault


class TestGuard:
    def test_a_healthy_robot_stays_armed(self, pair: Pair) -> None:
        pair.arm()
        assert not pair.pass_time(10.0, CLOSED, CLOSED)
        assert pair.guard.armed
        assert pair.guard.fault is None

    def test_heartbeats_that_cease_latch_and_come_too_late(self, pair: Pair) -> None:
        pair.arm()
        pair.pass_time(2.0, CLOSED, CLOSED)
        pair.now += HEARTBEAT_TIMEOUT + 0.01
        pair.wires[0].beat(CLOSED, 0, pair.now)
        assert pair.guard.look(pair.now)
        assert "node 1: no heartbeat" in fault_of(pair)
        assert not pair.guard.look(pair.now), "told once"
        pair.pass_time(5.0)
        assert "no heartbeat" in fault_of(pair)
        assert pair.guard.refusal(pair.now) == pair.guard.fault
        pair.guard.begin(pair.now)
        assert pair.guard.refusal(pair.now) is None

    def test_a_fault_of_one_axis_switches_all_off(self, pair: Pair) -> None:
        pair.arm()
        pair.now += 1.0
        pair.wires[0].beat(CLOSED, 0, pair.now)
        pair.wires[1].beat(IDLE, AxisError.MOTOR_OVER_TEMP, pair.now)
        assert pair.guard.look(pair.now)
        assert fault_of(pair) == "node 1: MOTOR_OVER_TEMP"
        assert not pair.guard.wanted

    def test_the_first_reason_is_kept(self, pair: Pair) -> None:
        pair.guard.latch("one")
        pair.guard.latch("two")
        assert pair.guard.fault == "one"

    def test_a_drives_watchdog_disarms_without_latching(self, pair: Pair) -> None:
        pair.arm()
        pair.pass_time(GRACE, CLOSED, CLOSED)
        pair.now += 0.1
        pair.beat(IDLE, IDLE, error=AxisError.WATCHDOG_TIMER_EXPIRED)
        assert pair.guard.look(pair.now)
        assert not pair.guard.wanted
        assert pair.guard.fault is None
        assert pair.guard.refusal(pair.now) is None

    def test_an_axis_that_never_starts_latches(self, pair: Pair) -> None:
        pair.guard.arm(pair.now)
        for wire in pair.wires:
            wire.axis.start()
        assert pair.pass_time(START_TIMEOUT + 0.2, CLOSED, IDLE)
        assert "node 1: expected closed-loop control" in fault_of(pair)

    @pytest.mark.parametrize("driven", [0.1, START_TIMEOUT + 0.2])
    def test_an_axis_that_leaves_closed_loop_for_no_reason_latches(self, pair: Pair, driven: float) -> None:
        pair.arm()
        pair.pass_time(driven, CLOSED, CLOSED)
        assert pair.pass_time(0.1, IDLE, CLOSED)
        assert "node 0" in fault_of(pair)

    def test_an_estop_at_a_drive_latches_until_released(self, pair: Pair) -> None:
        pair.arm()
        pair.pass_time(1.0, CLOSED, CLOSED)
        pair.wires[0].beat(IDLE, AxisError.ESTOP_REQUESTED, pair.now)
        assert pair.guard.look(pair.now)
        assert pair.guard.estop
        assert pair.guard.at_drive
        pair.pass_time(5.0)
        assert pair.guard.estop, "a drive that says no more of it changes nothing"
        pair.guard.begin(pair.now)
        assert pair.guard.estop, "a recovery is no release"
        assert "emergency stop" in str(pair.guard.refusal(pair.now))
        pair.guard.release(pair.now)
        assert pair.guard.refusal(pair.now) is None
        assert not pair.guard.wanted

    def test_what_a_drive_still_says_after_a_release_does_not_latch_again(self, pair: Pair) -> None:
        pair.guard.engage()
        pair.guard.release(pair.now)
        pair.beat(IDLE, IDLE, error=AxisError.ESTOP_REQUESTED)
        pair.guard.look(pair.now)
        assert not pair.guard.estop
        assert "emergency stop" in str(pair.guard.refusal(pair.now)), "but it is not armed either"

    def test_an_estop_that_stays_at_the_drive_latches_again(self, pair: Pair) -> None:
        pair.guard.release(pair.now)
        pair.now += GRACE + 0.1
        pair.beat(IDLE, IDLE, error=AxisError.ESTOP_REQUESTED)
        pair.guard.look(pair.now)
        assert pair.guard.estop

    @pytest.mark.parametrize("error", [AxisError.MOTOR_OVER_TEMP, AxisError.ESTOP_REQUESTED])
    def test_what_goes_wrong_right_after_an_explicit_act_counts_once_it_is_armed(self, pair: Pair, error: int) -> None:
        pair.guard.begin(pair.now)
        pair.arm()
        assert pair.now - 100.0 < GRACE
        pair.wires[1].beat(IDLE, error, pair.now)
        assert pair.guard.look(pair.now)
        assert pair.guard.fault or pair.guard.estop

    def test_engaging_disarms(self, pair: Pair) -> None:
        pair.arm()
        pair.guard.engage()
        assert not pair.guard.wanted
        assert not pair.guard.at_drive

    @pytest.mark.parametrize(
        "spoil",
        [
            lambda wire: wire.axis.receive(Frame(codec.frame_id(1, Command.HEARTBEAT), b"")),
            lambda wire: wire.hear(messages.EncoderEstimates(math.nan, 0.0)),
            lambda wire: wire.hear(messages.SetInputVel(3.0)),
        ],
    )
    def test_oddities_latch(self, pair: Pair, spoil: Callable[[Wire], None]) -> None:
        pair.arm()
        spoil(pair.wires[1])
        assert pair.guard.look(pair.now)
        assert fault_of(pair).startswith("node 1: ")

    def test_a_drive_that_has_a_fault_is_not_armed(self, pair: Pair) -> None:
        pair.beat(IDLE, IDLE, error=AxisError.DRV_FAULT)
        assert pair.guard.refusal(pair.now) == "node 0: DRV_FAULT"

    def test_a_drive_that_was_never_heard_is_not_armed(self) -> None:
        guard = Guard([OdriveAxis(0, lambda _: None)])
        guard.begin(50.0)
        assert guard.refusal(50.0) == "node 0: no heartbeat yet"
