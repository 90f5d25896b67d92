"""What goes wrong on a bus, each on vcan0: the robot ends up stopped, says why, and moves again only when told to."""

import math
import random
import socket
import struct
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest

from tests.hal.can.bench import KEYS, LINK, NODES, PATIENCE, START, CanBench, DeviceBench, Drives
from tests.vcan import INTERFACE
from vrg.bus.messages import Body, MeasuredPose, PlayerStatus, Poses, RefereeState, SpeedLimit, Stage
from vrg.errors import RobotError
from vrg.hal.can.bus import CanBus
from vrg.hal.can.emulator.faults import FaultKind
from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages
from vrg.testing.driver import STOPPED
from vrg.types import STILL, Pose, Twist

pytestmark = pytest.mark.vcan

BUS_OFF, ERROR_PASSIVE, NO_ACK, RESTARTED = (0x40, b""), (0x04, b"\0\x20"), (0x20, b""), (0x100, b"")
_CAN_ERR_FLAG = 0x20000000
AHEAD = Twist(0.33, 0.0)


@pytest.fixture
def drives() -> Iterator[Drives]:
    with Drives("odrive", [0, 1]) as drives:
        yield drives


@pytest.fixture
def bench(drives: Drives) -> Iterator[DeviceBench]:
    bench = DeviceBench("odrive", [0], [1])
    yield bench
    bench.close()


def ip(*arguments: str) -> None:
    """Do something to a network interface."""
    subprocess.run(["ip", *arguments], check=True, timeout=PATIENCE, capture_output=True)


def wait(bench: DeviceBench, condition: Callable[[], object], what: str) -> None:
    """Let time pass until the condition holds."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"waited {PATIENCE:g} s for {what}"
        bench.advance(0.05)


def armed(bench: DeviceBench) -> None:
    """Connected and armed, as a player does it."""
    bench.device.start()
    bench.advance(0.1)
    bench.device.arm()
    wait(bench, lambda: bench.device.read().armed, "an armed robot")


def driving(bench: DeviceBench) -> None:
    """Connected, armed and under way."""
    armed(bench)
    gets_going(bench)


def gets_going(bench: DeviceBench) -> None:
    """Drive as a player does until it is under way."""
    deadline = time.monotonic() + PATIENCE
    while not bench.speed > 0.3:
        assert time.monotonic() < deadline, f"it does not drive: {bench.device.read()}"
        drive_on(bench)


def drive_on(bench: DeviceBench) -> None:
    """What a player goes on doing: drive, or arm where it is not armed."""
    with suppress(RobotError):
        if bench.device.read().armed:
            bench.device.drive(AHEAD)
        else:
            bench.device.arm()
    bench.advance(0.1)


def notices(bench: DeviceBench) -> None:
    """Drive on as a player does until there is a fault."""
    deadline = time.monotonic() + PATIENCE
    while bench.device.read().fault is None:
        assert time.monotonic() < deadline, "nobody notices"
        drive_on(bench)


def assert_latched(bench: DeviceBench, drives: Drives, words: str) -> None:
    """The fault is told, every motor stands, and it stays so although the player goes on."""
    wait(bench, lambda: bench.device.read().fault, "a fault")
    fault = bench.device.read().fault
    assert fault is not None
    assert words in fault
    assert bench.device.read().latched
    wait(bench, lambda: at_rest(drives), "the motors to stand")
    for _ in range(8):
        drive_on(bench)
    assert at_rest(drives)
    # A drive that sends rubbish may say that it is on, which is told in place of whatever has latched before.
    assert bench.device.read().fault in (
        fault,
        f"{fault.partition(': ')[0]}: node 0: it is on, though it was told to be off",
    )
    with pytest.raises(RobotError):
        bench.device.drive(AHEAD)


def at_rest(drives: Drives) -> bool:
    """Whether every emulated motor stands."""
    return all(abs(drive.motor.velocity) < 0.5 for drive in drives.drives)


def recovers(bench: DeviceBench) -> None:
    """An official's word clears it, and the robot drives again once it is armed."""
    bench.recover()
    wait(bench, lambda: bench.device.read().fault is None, "the fault to be cleared")
    bench.advance(0.6)
    assert not bench.device.read().armed, "recovering does not arm"
    assert abs(bench.speed) < STOPPED
    gets_going(bench)
    assert bench.device.read().fault is None


def error_frame(error_class: int, data: bytes) -> None:
    """What a controller's driver would put on the interface."""
    with socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.bind((INTERFACE,))
        raw.send(struct.pack("<IB3x8s", _CAN_ERR_FLAG | error_class, 8, data.ljust(8, b"\0")))


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
        deadline = time.monotonic() + PATIENCE
        while bench.device.read().fault is None:
            assert time.monotonic() < deadline, "nobody notices"
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
        deadline = time.monotonic() + PATIENCE
        while other._energised:
            assert time.monotonic() < deadline, "the other wheel goes on"
            time.sleep(0.002)
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
        assert reading.encoders is not None
        assert reading.ins is not None
        odometry, where, turned = bench.odometry, reading.ins.value.pose, reading.encoders.value
        numbers = [odometry.twist.v, odometry.twist.w, odometry.pose.x, odometry.pose.y, where.theta]
        numbers += [turned.left, turned.right]
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
            (FaultKind.JUMP, -6, "turns more than its speed says"),
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
        with Drives("cia402", [1, 2]) as drives:
            yield drives

    @pytest.fixture
    def bench(self, drives: Drives) -> Iterator[DeviceBench]:
        bench = DeviceBench("cia402", [1], [2])
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
        deadline = time.monotonic() + PATIENCE
        while any(drive._energised for drive in drives.drives):
            assert time.monotonic() < deadline, "the drives go on"
            time.sleep(0.002)

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
        with Drives("cia402", [2], serial=0xABCDE):
            bench = DeviceBench("cia402", [1], [2])
            try:
                with pytest.raises(RobotError, match=r"node 2: .*id"):
                    bench.device.start()
            finally:
                bench.close()

    def test_another_protocol(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [1], [2])
        try:
            with pytest.raises(RobotError, match=r"odrive nodes 1, 2.*heard there: CANopen nodes 1, 2"):
                bench.device.start()
        finally:
            bench.close()


@pytest.mark.parametrize("protocol", ["odrive", "cia402"])
def test_a_recovery_of_a_robot_that_is_well_harms_nothing(protocol: str) -> None:
    """An official recovers all robots because of one; the player of another one ticks on meanwhile."""
    left, right = NODES[protocol]
    with Drives(protocol, [*left, *right]):
        bench = DeviceBench(protocol, left, right)
        try:
            driving(bench)
            bench.recover()
            for _ in range(15):
                drive_on(bench)
                assert bench.device.read().fault is None
            gets_going(bench)
        finally:
            bench.close()


class TestEmergencyStop:
    """By the match's bus, by a frame, by a button at a drive."""

    def test_a_button_at_a_drive_stops_all_and_needs_a_release(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.fault(1, FaultKind.ESTOP)
        wait(bench, lambda: bench.device.read().estop, "the stop to be seen")
        assert_latched(bench, drives, "emergency stop")
        bench.recover()
        bench.device.read()
        bench.advance(1.0)
        assert bench.device.read().estop, "a recovery is no release"
        bench.estop(False)
        bench.device.read()
        bench.advance(1.0)
        assert not bench.device.read().estop
        assert not bench.device.read().armed
        gets_going(bench)

    def test_a_frame_of_another_master(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.inject(codec.encode(0, messages.Estop()))
        wait(bench, lambda: bench.device.read().estop, "the stop to be seen")
        assert_latched(bench, drives, "emergency stop")

    def test_it_does_not_wait_for_a_tick(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.estop(True)  # no call of the robot follows
        deadline = time.monotonic() + PATIENCE
        while not all(drive._reason & messages.AxisError.ESTOP_REQUESTED for drive in drives.drives):
            assert time.monotonic() < deadline, "no Estop frame came"
            time.sleep(0.002)
        wait(bench, lambda: at_rest(drives), "the motors to stand")

    def test_a_drive_that_was_stopped_before_is_not_armed(self, drives: Drives) -> None:
        first = DeviceBench("odrive", [0], [1])
        driving(first)
        first.estop(True)
        first.advance(0.3)
        first.close()
        second = DeviceBench("odrive", [0], [1])
        try:
            second.device.start()
            second.advance(0.7)
            assert second.device.read().estop
            with pytest.raises(RobotError, match="emergency"):
                second.device.arm()
        finally:
            second.close()


class TestNewcomer:
    """Somebody else begins to speak to drives that are being driven."""

    @pytest.mark.parametrize("protocol", ["odrive", "cia402"])
    def test_it_listens_before_it_says_anything_and_the_first_one_notices_nothing(self, protocol: str) -> None:
        left, right = NODES[protocol]
        with Drives(protocol, [*left, *right]) as drives:
            first, second = DeviceBench(protocol, left, right), CanBench(protocol, left, right)
            errors: list[str] = []

            def connect() -> None:
                try:
                    second.driver.connect()
                except RobotError as error:
                    errors.append(str(error))

            try:
                driving(first)
                thread = threading.Thread(target=connect)
                thread.start()
                while thread.is_alive():
                    drive_on(first)
                assert len(errors) == 1
                assert f"node {left[0]}: another program commands it too" in errors[0]
                for _ in range(10):
                    drive_on(first)
                assert first.device.read().fault is None
                assert not at_rest(drives)
            finally:
                second.close()
                first.close()


class TestCommands:
    """What is sent, and what never is."""

    def test_nothing_is_sent_while_nobody_drives(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        frames = heard(bench, 1.0)
        setpoints = [f for f in frames if codec.command_of(f.id) == messages.Command.SET_INPUT_VEL]
        assert len(setpoints) <= 2
        wait(bench, lambda: at_rest(drives), "the drives' watchdogs to stop the motors")
        assert all(drive._reason & messages.AxisError.WATCHDOG_TIMER_EXPIRED for drive in drives.drives)

    def test_a_player_that_was_late_may_arm_again(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.advance(1.0)
        reading = bench.device.read()
        assert not reading.armed
        assert reading.fault is None
        with pytest.raises(RobotError, match="arm"):
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
        bench.hear(KEYS.poses, Poses(bodies=[Body("r", START, 0.0, 0.0, True)]))
        bench.advance(0.05)
        for _ in range(20):
            bench.device.drive(AHEAD)
            bench.device.read()
            bench.advance(0.05)
        told = [body for key, body in bench.said if key == KEYS.robot_pose("r").key]
        assert told
        assert isinstance(told[-1], MeasuredPose)
        way = math.hypot(told[-1].pose.x - START.x, told[-1].pose.y - START.y)
        assert 0.1 < way < 0.5
        assert told[-1].pose.theta == pytest.approx(START.theta, abs=0.05)


@pytest.fixture
def restored() -> Iterator[None]:
    """The interface is there and up again after the test."""
    yield
    with suppress(subprocess.CalledProcessError):
        ip("link", "add", INTERFACE, "type", "vcan")
    with suppress(subprocess.CalledProcessError):
        subprocess.run(["tc", "qdisc", "del", "dev", INTERFACE, "root"], check=False, capture_output=True)
    ip("link", "set", INTERFACE, "up")


class TestUnwatched:
    """Drives without a watchdog, whose owner has said that this will do: nothing but an order stops them."""

    @pytest.fixture
    def drives(self) -> Iterator[Drives]:
        with Drives("odrive", [0, 1], watchdog=0.0) as drives:
            yield drives

    @pytest.fixture
    def bench(self, drives: Drives) -> Iterator[DeviceBench]:
        bench = DeviceBench("odrive", [0], [1], watchdog="unsafe")
        yield bench
        bench.close()

    def test_nobody_who_has_not_said_so_arms_them(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [0], [1])
        try:
            bench.device.start()
            bench.device.arm()
            wait(bench, lambda: bench.device.read().fault, "a fault")
            assert "its own watchdog has not stopped it" in (bench.device.read().fault or "")
            assert at_rest(drives)
        finally:
            bench.close()

    @pytest.mark.usefixtures("restored")
    def test_they_are_told_off_again_when_the_bus_is_back(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        ip("link", "set", INTERFACE, "down")
        wait(bench, lambda: bench.device.read().fault, "a fault")
        bench.advance(1.0)
        assert not at_rest(drives), "nothing has reached them"
        ip("link", "set", INTERFACE, "up")
        wait(bench, lambda: at_rest(drives), "the motors to stand")
        bench.advance(0.5)
        assert at_rest(drives)
        recovers(bench)

    def test_a_drive_that_does_not_obey_is_a_fault_of_its_own(
        self, bench: DeviceBench, drives: Drives, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        driving(bench)
        monkeypatch.setattr(drives.drives[1], "_request", lambda _state, _now: None)
        bench.device.disarm()
        wait(bench, lambda: bench.device.read().fault, "a fault")
        assert bench.device.read().fault == "r: node 1: it is on, though it was told to be off"
        assert bench.device.read().latched


@pytest.mark.usefixtures("restored")
class TestInterface:
    """The interface itself goes, and comes back."""

    def test_down_and_up(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        ip("link", "set", INTERFACE, "down")
        assert_latched(bench, drives, "the interface is down")
        ip("link", "set", INTERFACE, "up")
        for _ in range(8):
            drive_on(bench)
        assert bench.device.read().fault, "an interface that is back clears nothing"
        recovers(bench)

    def test_deleted_and_made_again(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        ip("link", "del", INTERFACE)
        assert_latched(bench, drives, "the interface is ")
        bench.recover()
        wait(bench, lambda: "no such CAN interface" in (bench.device.read().fault or ""), "to be told what is missing")
        ip("link", "add", INTERFACE, "type", "vcan")
        ip("link", "set", INTERFACE, "up")
        wait(bench, lambda: all(d._now > time.monotonic() - 0.05 for d in drives.drives), "the drives to be back")
        bench.advance(0.5)
        recovers(bench)

    def test_a_full_transmit_queue(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        tc = ["tc", "qdisc", "add", "dev", INTERFACE, "root", "netem", "delay", "100s", "limit", "1"]
        subprocess.run(tc, check=True, timeout=PATIENCE)
        assert_latched(bench, drives, "")
        fault = bench.device.read().fault
        assert fault is not None
        assert "transmit queue is full" in fault or "no heartbeat" in fault
        with pytest.raises(RobotError, match="queue is full"):
            fill(bench)
        subprocess.run(["tc", "qdisc", "del", "dev", INTERFACE, "root"], check=True, timeout=PATIENCE)
        bench.advance(0.3)
        recovers(bench)

    @pytest.mark.parametrize(
        ("frame", "words"), [(BUS_OFF, "bus-off"), (ERROR_PASSIVE, "error-passive"), (NO_ACK, "acknowledges")]
    )
    def test_error_frames(self, bench: DeviceBench, drives: Drives, frame: tuple[int, bytes], words: str) -> None:
        driving(bench)
        error_frame(*frame)
        assert_latched(bench, drives, words)
        error_frame(*RESTARTED)
        for _ in range(5):
            drive_on(bench)
        assert bench.device.read().fault, "a controller that starts again clears nothing"
        recovers(bench)

    def test_a_harmless_error_frame(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        error_frame(0x04, b"\0\x08")  # a warning
        for _ in range(5):
            drive_on(bench)
        assert bench.device.read().fault is None

    def test_old_frames_in_the_queue_are_not_taken_for_new_ones(self, bench: DeviceBench, drives: Drives) -> None:
        """A process that was frozen finds heartbeats of before, of a drive that has died meanwhile."""
        driving(bench)
        # The receive thread stands, as it would in a frozen process; the kernel's queue fills.
        with bench.driver._train._watch.lock:
            time.sleep(0.5)
            bench.cut()
            time.sleep(1.5)
        wait(bench, lambda: bench.device.read().fault, "a fault")
        assert_latched(bench, drives, "no heartbeat")

    def test_frames_that_wait_to_be_read_are_not_missing(self, bench: DeviceBench, drives: Drives) -> None:
        """A process that was kept from running finds the heartbeats of a drive that is well, all of them."""
        driving(bench)
        lock = bench.driver._train._watch.lock
        with lock:
            time.sleep(1.5)
            with pytest.raises(RobotError, match="nothing has been heard of the bus"):
                bench.device.drive(AHEAD)
            assert bench.device.read().fault is None
        bench.advance(0.3)
        assert bench.device.read().fault is None
        assert not bench.device.read().armed, "the drives' watchdogs have stopped the motors meanwhile"
        gets_going(bench)

    def test_receive_overflow(self, bench: DeviceBench, drives: Drives) -> None:
        """More than the queue holds: what is lost is the newest, and what is left is old."""
        driving(bench)
        noise = codec.encode(0, messages.Torques(0.0, 0.0))
        with bench.driver._train._watch.lock:
            flooded = 0
            for _ in range(30_000):
                with suppress(Exception):
                    bench.inject(noise)
                    flooded += 1
            time.sleep(1.0)
        assert flooded > 10_000
        assert_latched(bench, drives, "no heartbeat")
        recovers(bench)


class TestConnecting:
    """What is wrong before anything moves is said before anything is armed."""

    def test_a_wrong_node_id(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [0], [7])
        try:
            with pytest.raises(RobotError, match=rf"odrive node 7 on {INTERFACE}.*heard there: ODrive nodes 0, 1"):
                bench.device.start()
        finally:
            bench.close()

    def test_a_missing_interface(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [0], [1], channel="vcan77")
        try:
            with pytest.raises(RobotError, match=r"vcan77: no such CAN interface on this machine.*ip link add vcan77"):
                bench.device.start()
        finally:
            bench.close()

    def test_an_unknown_kind_of_interface(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [0], [1], interface="tin-can")
        try:
            with pytest.raises(RobotError, match="tin-can"):
                bench.device.start()
        finally:
            bench.close()

    def test_two_drives_with_one_id(self, drives: Drives) -> None:
        with Drives("odrive", [1], serial=0xABCDE):
            bench = DeviceBench("odrive", [0], [1])
            try:
                with pytest.raises(RobotError, match=r"node 1: 2 drives have this id: serial numbers 1001 and ABCDE"):
                    bench.device.start()
            finally:
                bench.close()

    def test_another_protocol(self, drives: Drives) -> None:
        bench = DeviceBench("cia402", [1], [2])
        try:
            with pytest.raises(RobotError, match=r"cia402 nodes 1, 2.*heard there: ODrive nodes 0, 1"):
                bench.device.start()
        finally:
            bench.close()

    def test_an_interface_that_is_down(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [0], [1])
        ip("link", "set", INTERFACE, "down")
        try:
            with pytest.raises(RobotError, match="down"):
                bench.device.start()
        finally:
            ip("link", "set", INTERFACE, "up")
            bench.close()


def heard(bench: DeviceBench, seconds: float) -> list[Frame]:
    """What is on the bus while time passes."""
    frames: list[Frame] = []
    bus = CanBus(LINK, frames.append)
    bus.start()
    bench.advance(seconds)
    bus.stop()
    return frames


def fill(bench: DeviceBench) -> None:
    """Send until the queue is full."""
    bus = CanBus(LINK, lambda _: None)
    bus.start()
    try:
        for _ in range(100):
            bus.send(Frame(0x7FF, random.randbytes(8)))
    finally:
        bus.stop()


def referee(halted: str | None = None, may_move: bool = True) -> RefereeState:
    """The referee's word on robot r."""
    me = PlayerStatus(
        name="r", team="t", role="minnow", state="active", may_move=may_move, radius=0.4, pose=Pose(0.0, 0.0, 0.0)
    )
    return RefereeState(
        game="g", stage=Stage.PLAY_ROUND, halted=halted, way_out=None, waiting=[], clock=0.0, total=0.0, round=1,
        rounds=1, score={}, players=[me], zones=[],
    )  # fmt: skip
