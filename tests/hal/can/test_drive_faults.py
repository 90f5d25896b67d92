"""What goes wrong with a drive, or is said to it by others: the robot stops, says why, and waits to be told to move."""

import math
from collections.abc import Iterator
from contextlib import suppress

import pytest

from tests.hal.can.bench import HERE, KEYS, NODES, PATIENCE, START, DeviceBench, Drives, Lab
from tests.hal.can.handling import (
    AHEAD,
    armed,
    assert_latched,
    at_rest,
    drive_on,
    driving,
    gets_going,
    notices,
    recovers,
    wait,
)
from vrg.bus.messages import MeasuredPose, PlayerStatus, RefereeState, SpeedLimit, Stage
from vrg.errors import RobotError
from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.sensors.encoders import Encoders
from vrg.hal.sensors.ins import Ins
from vrg.types import STILL, Pose, Twist


@pytest.fixture
def drives() -> Iterator[Drives]:
    with Drives("odrive", [0, 1], link=HERE) as drives:
        yield drives


@pytest.fixture
def bench(drives: Drives) -> Iterator[DeviceBench]:
    bench = DeviceBench("odrive", [0], [1], link=HERE)
    yield bench
    bench.close()


class TestDrives:
    """Something is wrong with one drive."""

    @pytest.mark.parametrize("node", [0, 1])
    def test_heartbeat_loss(self, bench: DeviceBench, drives: Drives, node: int) -> None:
        driving(bench)
        bench.fault(node, FaultKind.SILENCE)
        assert_latched(bench, drives, f"node {node}: no heartbeat")
        bench.fault(node, FaultKind.END)
        for _ in range(8):
            drive_on(bench)
        assert bench.device.read().fault, "heartbeats that come back clear nothing"
        recovers(bench)

    def test_a_frozen_drive(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.fault(0, FaultKind.FREEZE)
        assert_latched(bench, drives, "node 0: no heartbeat")
        bench.fault(0, FaultKind.END)
        bench.advance(0.3)
        recovers(bench)

    def test_a_reboot(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        before = bench.odometry.pose
        bench.fault(1, FaultKind.REBOOT)
        deadline = bench.now + PATIENCE
        while bench.device.read().fault is None:
            assert bench.now < deadline, "nobody notices"
            drive_on(bench)
        assert_latched(bench, drives, "node 1:")
        after = bench.odometry.pose
        assert math.hypot(after.x - before.x, after.y - before.y) < 0.5, "the jump is no way that it went"
        recovers(bench)

    def test_one_wheel_faults_and_the_other_idles_at_once(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.fault(0, FaultKind.ERROR, value=messages.AxisError.MOTOR_OVER_TEMP)
        # Nobody reads or drives meanwhile: it is the receive thread that switches the other one off.
        other = drives.drives[1]
        deadline = bench.now + PATIENCE
        while other._energised:
            assert bench.now < deadline, "the other wheel goes on"
            bench.clock.sleep(0.002)
        assert not other._reason, "it was told to idle before its own watchdog noticed"
        assert_latched(bench, drives, "node 0: MOTOR_OVER_TEMP")
        recovers(bench)

    @pytest.mark.parametrize(
        ("bits", "words"),
        [(0x200, "DC_BUS_UNDER_VOLTAGE"), (0x20 | 0x1000, "DRV_FAULT, CURRENT_LIMIT_VIOLATION"), (1 << 29, "0x2000")],
    )
    def test_errors_are_told_in_words(self, bench: DeviceBench, drives: Drives, bits: int, words: str) -> None:
        driving(bench)
        bench.fault(1, FaultKind.ERROR, value=bits)
        assert_latched(bench, drives, words)

    @pytest.mark.parametrize(
        ("kind", "words"),
        [
            (FaultKind.NAN, "nan"),
            (FaultKind.LENGTH, "malformed"),
            (FaultKind.JUMP, "jumped"),
            (FaultKind.GARBAGE, "node 0:"),
        ],
    )
    def test_rubbish(self, bench: DeviceBench, drives: Drives, kind: FaultKind, words: str) -> None:
        driving(bench)
        bench.fault(0, kind)
        assert_latched(bench, drives, words)
        reading = bench.device.read()
        encoders, ins = reading.latest(Encoders), reading.latest(Ins)
        assert encoders is not None
        assert ins is not None
        odometry, where, turned = bench.odometry, ins.value.pose, encoders.value
        numbers = [odometry.twist.v, odometry.twist.w, odometry.pose.x, odometry.pose.y, where.theta]
        numbers += turned.counts
        assert all(math.isfinite(number) for number in numbers)
        bench.fault(0, FaultKind.END)
        bench.advance(0.2)
        if reading.estop:
            bench.estop(False)  # among random bits there was one of an emergency stop
        recovers(bench)

    @pytest.mark.parametrize(
        ("kind", "value", "words"),
        [
            (FaultKind.REVERSE, 0, "the wrong way round"),
            (FaultKind.BLOCK, 0, "it stands, though it was asked for 23.9 turn/s"),
            (FaultKind.RUNAWAY, 0, "it runs away"),
            (FaultKind.SCALE, 0, "where this robot's motors reach 50.64"),
            (FaultKind.JUMP, 15, "its position jumped"),
            (FaultKind.JUMP, 3, "its position jumped by +"),
            (FaultKind.JUMP, -6, "its position jumped by -"),
        ],
    )
    def test_setpoint_speed_and_position_are_compared(
        self, bench: DeviceBench, drives: Drives, kind: FaultKind, value: int, words: str
    ) -> None:
        driving(bench)
        bench.fault(0, kind, value=value)
        notices(bench)
        assert_latched(bench, drives, words)
        bench.fault(0, FaultKind.END)
        bench.advance(0.2)
        recovers(bench)

    @pytest.mark.parametrize(
        ("message", "words"),
        [
            (messages.EncoderEstimates(0.0, 1e38), "its encoder says 1e+38 turn/s"),
            (messages.BusVoltageCurrent(math.nan, 0.0), "its supply says nan V"),
        ],
    )
    def test_numbers_that_cannot_be(
        self, bench: DeviceBench, drives: Drives, message: messages.Message, words: str
    ) -> None:
        driving(bench)
        bench.inject(codec.encode(0, message))
        assert_latched(bench, drives, words)
        assert math.isfinite(bench.odometry.pose.x)
        recovers(bench)

    def test_a_fault_that_is_still_there_comes_back(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.fault(0, FaultKind.SILENCE)
        assert_latched(bench, drives, "no heartbeat")
        bench.recover()
        bench.device.read()
        bench.advance(1.5)
        assert_latched(bench, drives, "no heartbeat")

    def test_a_drive_that_someone_else_idles(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        for _ in range(12):
            drive_on(bench)
        bench.inject(codec.encode(1, messages.SetAxisState(messages.AxisState.IDLE)))
        for _ in range(5):
            drive_on(bench)
        assert_latched(bench, drives, "node 1: another program commands it too: SetAxisState")

    @pytest.mark.parametrize(
        "order",
        [
            messages.SetLimits(120.0, 12.0),
            messages.RxSdo(1, 3, 0x43480000),  # the ramp, 200 turn/s^2
            messages.SetAxisState(messages.AxisState.CLOSED_LOOP_CONTROL),
        ],
        ids=lambda order: type(order).__name__,
    )
    @pytest.mark.parametrize("node", [1, codec.BROADCAST], ids=["to it", "to all"])
    def test_another_masters_orders(
        self, bench: DeviceBench, drives: Drives, order: messages.Message, node: int
    ) -> None:
        driving(bench)
        bench.inject(codec.encode(node, order))
        assert_latched(bench, drives, f"another program commands it too: {type(order).__name__}")
        recovers(bench)

    def test_another_master(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.inject(codec.encode(1, messages.SetInputVel(5.0)))
        assert_latched(bench, drives, "node 1: another program commands it too")
        recovers(bench)


class TestCia402:
    """The other protocol's drives, where they differ."""

    @pytest.fixture
    def drives(self) -> Iterator[Drives]:
        with Drives("cia402", [1, 2], link=HERE) as drives:
            yield drives

    @pytest.fixture
    def bench(self, drives: Drives) -> Iterator[DeviceBench]:
        bench = DeviceBench("cia402", [1], [2], link=HERE)
        yield bench
        bench.close()

    @pytest.mark.parametrize(
        ("kind", "words"),
        [
            (FaultKind.SILENCE, "node 2: no heartbeat"),
            (FaultKind.FREEZE, "node 2: no heartbeat"),
            (FaultKind.ERROR, "node 2: "),
            (FaultKind.REBOOT, "node 2: "),
            (FaultKind.LENGTH, "node 2: a malformed frame"),
            (FaultKind.JUMP, "node 2: its position jumped"),
            (FaultKind.GARBAGE, "node 2: "),
            (FaultKind.REVERSE, "node 2: it turns at -"),
            (FaultKind.RUNAWAY, "node 2: it turns at "),
        ],
    )
    def test_what_goes_wrong_latches_and_is_recovered_from(
        self, bench: DeviceBench, drives: Drives, kind: FaultKind, words: str
    ) -> None:
        driving(bench)
        bench.fault(2, kind)
        notices(bench)
        estop = bench.device.read().estop
        assert_latched(bench, drives, "node 2: " if estop else words)
        bench.fault(2, FaultKind.END)
        bench.advance(0.4)
        if bench.device.read().estop:
            bench.estop(False)  # among random bytes there was the code of a safe torque off
        recovers(bench)

    def test_a_button_at_a_drive(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.fault(1, FaultKind.ESTOP)
        wait(bench, lambda: bench.device.read().estop, "the stop to be seen")
        assert_latched(bench, drives, "emergency stop")
        bench.estop(False)
        wait(bench, lambda: not bench.device.read().estop, "the release")
        gets_going(bench)

    def test_the_match_s_emergency_stop_does_not_wait_for_a_tick(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.estop(True)
        deadline = bench.now + PATIENCE
        while any(drive._energised for drive in drives.drives):
            assert bench.now < deadline, "the drives go on"
            bench.clock.sleep(0.002)

    def test_another_master(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.inject(Frame(0x300 + 1, bytes(4)))
        assert_latched(bench, drives, "node 1: another program commands it too")
        recovers(bench)

    def test_nothing_is_sent_while_nobody_drives(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        frames = heard(bench, 1.0)
        assert not [f for f in frames if f.id & ~0x7F == 0x300]
        wait(bench, lambda: at_rest(drives), "the drives' watchdogs to stop the motors")

    def test_two_drives_with_one_id(self, drives: Drives) -> None:
        with Drives("cia402", [2], serial=0xABCDE, link=HERE):
            bench = DeviceBench("cia402", [1], [2], link=HERE)
            try:
                with pytest.raises(RobotError, match=r"node 2: .*id"):
                    bench.device.start()
            finally:
                bench.close()

    def test_another_protocol(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [1], [2], link=HERE)
        try:
            with pytest.raises(RobotError, match=r"odrive nodes 1, 2.*heard there: CANopen nodes 1, 2"):
                bench.device.start()
        finally:
            bench.close()


@pytest.mark.parametrize("protocol", ["odrive", "cia402"])
def test_a_recovery_of_a_robot_that_is_well_harms_nothing(protocol: str) -> None:
    """An official recovers all robots because of one; the player of another one ticks on meanwhile."""
    left, right = NODES[protocol]
    with Drives(protocol, [*left, *right], link=HERE):
        bench = DeviceBench(protocol, left, right, link=HERE)
        try:
            driving(bench)
            bench.recover()
            for _ in range(15):
                drive_on(bench)
                assert bench.device.read().fault is None
            gets_going(bench)
        finally:
            bench.close()


class TestCommands:
    """What is sent, and what never is."""

    def test_nothing_is_sent_while_nobody_drives(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        frames = heard(bench, 1.0)
        setpoints = [f for f in frames if codec.command_of(f.id) == messages.Command.SET_INPUT_VEL]
        assert len(setpoints) <= 2
        wait(bench, lambda: at_rest(drives), "the motors to stand")

    def test_a_player_that_was_late_may_arm_again(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.advance(1.0)
        reading = bench.device.read()
        assert not reading.armed
        assert reading.fault is None
        with pytest.raises(RobotError, match=r"its motors were switched off, as no setpoint came for 0.2 s.*Arm again"):
            bench.device.drive(AHEAD)
        gets_going(bench)

    def test_the_match_s_speed_limit_holds(self, bench: DeviceBench, drives: Drives) -> None:
        armed(bench)
        bench.hear(KEYS.speed_limit("r"), SpeedLimit(v_max=0.2))
        bench.advance(0.05)
        assert bench.device.drive(Twist(100.0, 0.0)).v == pytest.approx(0.2)
        for _ in range(20):
            with suppress(RobotError):
                bench.device.drive(Twist(100.0, 0.0))
            bench.advance(0.05)
        assert bench.speed < 0.21

    def test_a_referee_that_halts_holds_it(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.hear(KEYS.referee_state, referee(halted="because"))
        bench.advance(0.05)
        assert bench.device.drive(AHEAD) == STILL
        bench.hear(KEYS.referee_state, referee(may_move=False))
        bench.advance(0.05)
        assert bench.device.drive(AHEAD) == STILL
        bench.hear(KEYS.referee_state, referee())
        bench.advance(0.05)
        assert bench.device.drive(AHEAD) == AHEAD

    def test_it_tells_the_world_where_it_is(self, bench: DeviceBench, drives: Drives) -> None:
        armed(bench)
        bench.hear(KEYS.robot_seen("r"), MeasuredPose(pose=START))
        bench.advance(0.05)
        for _ in range(20):
            bench.device.drive(AHEAD)
            bench.device.read()
            bench.device.report()
            bench.advance(0.05)
        told = [body for key, body in bench.said if key == KEYS.robot_pose("r").key]
        assert told
        assert isinstance(told[-1], MeasuredPose)
        way = math.hypot(told[-1].pose.x - START.x, told[-1].pose.y - START.y)
        assert 0.1 < way < 0.5
        assert told[-1].pose.theta == pytest.approx(START.theta, abs=0.05)


def heard(bench: DeviceBench, seconds: float) -> list[Frame]:
    """What is on the bus while time passes."""
    frames: list[Frame] = []
    bus = Lab.simulation.bus(HERE, frames.append)
    bus.start()
    bench.advance(seconds)
    bus.stop()
    return frames


def referee(halted: str | None = None, may_move: bool = True) -> RefereeState:
    """The referee's word on robot r."""
    me = PlayerStatus(
        name="r", team="t", role="minnow", state="active", may_move=may_move, radius=0.4, pose=Pose(0.0, 0.0, 0.0)
    )
    return RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=(), clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=(me,), zones=(),
    )  # fmt: skip
