"""One ODrive axis, and the judgement over all axes of a robot: pure, by frames and times."""

import math
from collections.abc import Callable

import pytest

from vrg.errors import RobotError
from vrg.hal.can import odrive
from vrg.hal.can.axis import State
from vrg.hal.can.frame import Frame
from vrg.hal.can.guard import GRACE, HEARTBEAT_TIMEOUT, START_TIMEOUT, Guard
from vrg.hal.can.odrive import AxisError, AxisState, Command
from vrg.hal.can.odrive_axis import OdriveAxis

IDLE, CLOSED = AxisState.IDLE, AxisState.CLOSED_LOOP_CONTROL


class Wire:
    """An axis whose frames are kept, and what a drive would say to it."""

    def __init__(self, node: int = 4) -> None:
        self.sent: list[Frame] = []
        self.axis = OdriveAxis(node, self.sent.append)

    def hear(self, message: odrive.Message, at: float = 1.0, node: int | None = None) -> None:
        frame = odrive.encode(self.axis.node if node is None else node, message)
        self.axis.receive(Frame(frame.id, frame.data, at=at))

    def beat(self, state: int = IDLE, error: int = 0, at: float = 1.0) -> None:
        self.hear(odrive.Heartbeat(error, state), at)

    def said(self) -> list[odrive.Message]:
        """What was sent since the last call, but for questions."""
        sent, self.sent[:] = [odrive.decode(f) for f in self.sent if not f.remote], []
        return sent


@pytest.fixture
def wire() -> Wire:
    return Wire()


class TestAxis:
    def test_it_is_silent_until_it_has_been_heard(self, wire: Wire) -> None:
        assert wire.axis.state is State.SILENT
        assert wire.axis.heard == -math.inf
        wire.beat(at=3.5)
        assert (wire.axis.state, wire.axis.heard) == (State.IDLE, 3.5)

    def test_a_start_sends_mode_zero_and_closed_loop_in_this_order(self, wire: Wire) -> None:
        wire.beat()
        wire.axis.start()
        assert wire.said() == [
            odrive.SetControllerMode(odrive.ControlMode.VELOCITY, odrive.PASSTHROUGH),
            odrive.SetInputVel(0.0),
            odrive.SetAxisState(CLOSED),
        ]
        assert wire.axis.state is State.STARTING
        wire.beat(IDLE)  # sent before the drive had started
        assert wire.axis.state is State.STARTING
        wire.beat(CLOSED)
        assert wire.axis.state is State.CLOSED_LOOP

    def test_closed_loop_that_ends_is_idle(self, wire: Wire) -> None:
        wire.beat()
        wire.axis.start()
        wire.beat(CLOSED)
        wire.beat(IDLE)
        assert wire.axis.state is State.IDLE

    def test_a_position_far_from_zero_is_set_back_before_a_start(self, wire: Wire) -> None:
        wire.hear(odrive.EncoderEstimates(1e6, 0.0))
        wire.axis.start()
        assert wire.said()[0] == odrive.SetAbsolutePosition(0.0)

    @pytest.mark.parametrize(
        ("error", "state", "fault", "starved"),
        [
            (AxisError.WATCHDOG_TIMER_EXPIRED, State.IDLE, None, True),
            (AxisError.ESTOP_REQUESTED, State.ESTOP, None, False),
            (AxisError.DRV_FAULT, State.FAULT, "DRV_FAULT", False),
            (AxisError.DRV_FAULT | AxisError.ESTOP_REQUESTED, State.ESTOP, "DRV_FAULT", False),
            (AxisError.WATCHDOG_TIMER_EXPIRED | AxisError.MISSING_ESTIMATE, State.FAULT, "MISSING_ESTIMATE", True),
        ],
    )
    def test_errors(self, wire: Wire, error: int, state: State, fault: str | None, starved: bool) -> None:
        wire.beat(IDLE, error)
        assert (wire.axis.state, wire.axis.fault, wire.axis.starved) == (state, fault, starved)

    def test_a_drive_that_calibrates_is_no_idle_one(self, wire: Wire) -> None:
        wire.beat(AxisState.MOTOR_CALIBRATION)
        assert wire.axis.state is State.FAULT
        assert wire.axis.fault is not None
        assert "MOTOR_CALIBRATION" in wire.axis.fault

    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    def test_numbers_that_are_none_are_odd_and_change_nothing(self, wire: Wire, bad: float) -> None:
        wire.hear(odrive.EncoderEstimates(2.0, 1.0), at=5.0)
        for estimate in (odrive.EncoderEstimates(bad, 1.0), odrive.EncoderEstimates(1.0, bad)):
            wire.hear(estimate, at=6.0)
        assert (wire.axis.position, wire.axis.velocity, wire.axis.measured) == (2.0, 1.0, 5.0)
        assert wire.axis.odd is not None

    def test_a_short_frame_is_odd(self, wire: Wire) -> None:
        wire.axis.receive(Frame(odrive.frame_id(4, Command.HEARTBEAT), b"\0\0\0"))
        assert wire.axis.odd == "a malformed frame: Heartbeat: expected 8 bytes, got 3"
        wire.axis.forget_oddities()
        assert wire.axis.odd is None

    @pytest.mark.parametrize(
        "message",
        [odrive.SetInputVel(1.0), odrive.SetInputPos(1.0), odrive.SetInputTorque(1.0), odrive.SetControllerMode(1, 1)],
    )
    def test_another_master_is_odd(self, wire: Wire, message: odrive.Message) -> None:
        wire.hear(message)
        assert wire.axis.odd == "another program commands it too"

    def test_somebody_elses_estop_frame_counts_at_once(self, wire: Wire) -> None:
        wire.beat(CLOSED)
        wire.hear(odrive.Estop())
        assert wire.axis.state is State.ESTOP

    def test_other_nodes_and_extended_and_remote_frames_are_not_its_business(self, wire: Wire) -> None:
        wire.hear(odrive.Heartbeat(0xFF, 1), node=5)
        wire.axis.receive(Frame(odrive.frame_id(4, 1), bytes(8), extended=True))
        wire.axis.receive(Frame(odrive.frame_id(4, 1), remote=True))
        assert wire.axis.state is State.SILENT
        assert wire.axis.odd is None

    def test_two_serial_numbers_are_a_problem(self, wire: Wire) -> None:
        wire.hear(odrive.Version(2, 4, 4, 58, 0, 6, 11, 0))
        wire.hear(odrive.Address(4, 0xAAA))
        assert wire.axis.identified
        assert (wire.axis.problem, wire.axis.serial, wire.axis.firmware) == (None, "AAA", "0.6.11")
        wire.hear(odrive.Address(4, 0xBBB))
        assert wire.axis.problem is not None
        assert "AAA and BBB" in wire.axis.problem

    def test_another_protocol_version_is_a_problem(self, wire: Wire) -> None:
        wire.hear(odrive.Version(3, 4, 4, 58, 0, 7, 0, 0))
        assert wire.axis.problem == "expected CANSimple protocol version 2, got 3"

    def test_short_ways(self, wire: Wire) -> None:
        wire.axis.stop_now()
        wire.axis.clear()
        wire.axis.idle()
        wire.axis.command(2.5)
        assert wire.said() == [odrive.Estop(), odrive.ClearErrors(), odrive.SetAxisState(IDLE), odrive.SetInputVel(2.5)]

    @pytest.mark.parametrize(("node", "good"), [(0, True), (62, True), (63, False), (-1, False), (100, False)])
    def test_ids(self, node: int, good: bool) -> None:
        assert (OdriveAxis.check_node(node) is None) == good


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
            lambda wire: wire.axis.receive(Frame(odrive.frame_id(1, Command.HEARTBEAT), b"")),
            lambda wire: wire.hear(odrive.EncoderEstimates(math.nan, 0.0)),
            lambda wire: wire.hear(odrive.SetInputVel(3.0)),
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


def test_robot_errors_of_the_sender_go_on_to_the_caller() -> None:
    def full(_: Frame) -> None:
        raise RobotError("full")

    with pytest.raises(RobotError, match="full"):
        OdriveAxis(0, full).command(1.0)
