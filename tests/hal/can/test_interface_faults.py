"""What goes wrong with a bus, or with those who share it: the robot stops, says why, and waits to be told to move."""

import math
import random
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import pytest

from tests.hal.can.bench import LINK, NODES, PATIENCE, CanBench, DeviceBench, Drives
from tests.hal.can.handling import (
    AHEAD,
    assert_latched,
    at_rest,
    drive_on,
    driving,
    gets_going,
    notices,
    recovers,
    wait,
)
from tests.vcan import INTERFACE
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.frame import Frame
from vrg.hal.can.guard import COAST_TIMEOUT
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.can.workshop.simulation import Simulation
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.types import Twist

FAST = Twist(0.7, 0.0)


@pytest.fixture
def drives() -> Iterator[Drives]:
    with Drives("odrive", [0, 1]) as drives:
        yield drives


@pytest.fixture
def bench(drives: Drives) -> Iterator[DeviceBench]:
    bench = DeviceBench("odrive", [0], [1])
    yield bench
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
        told = bench.clock.wait(
            lambda: all(drive._reason & messages.AxisError.ESTOP_REQUESTED for drive in drives.drives), PATIENCE
        )
        assert told, "no Estop frame came"
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
    def test_it_listens_before_it_says_anything_and_the_first_one_notices_nothing(
        self, lab: Simulation, protocol: str
    ) -> None:
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
                newcomer = lab.clock.spawn(connect, "newcomer")
                while newcomer.is_alive():
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
            notices(bench)
            assert "its own watchdog has not stopped it" in (bench.device.read().fault or "")
            assert at_rest(drives)
        finally:
            bench.close()

    def test_they_are_told_off_again_when_the_bus_is_back(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.wire.trouble = "the interface is down"
        wait(bench, lambda: bench.device.read().fault, "a fault")
        bench.advance(1.0)
        assert not at_rest(drives), "nothing has reached them"
        bench.wire.trouble = None
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


class TestInterface:
    """The interface itself goes, and comes back."""

    @pytest.mark.parametrize("trouble", ["the interface is down", "bus-off: too many errors", "unplugged"])
    def test_nothing_passes_and_then_it_does_again(self, bench: DeviceBench, drives: Drives, trouble: str) -> None:
        driving(bench)
        bench.wire.trouble = trouble
        assert_latched(bench, drives, trouble)
        bench.wire.trouble = None
        for _ in range(8):
            drive_on(bench)
        assert bench.device.read().fault, "an interface that is back clears nothing"
        recovers(bench)

    def test_deleted_and_made_again(self, bench: DeviceBench, drives: Drives) -> None:
        driving(bench)
        bench.wire.trouble = "the interface is gone"
        bench.wire.missing = "no such CAN interface"
        assert_latched(bench, drives, "the interface is ")
        bench.recover()
        wait(bench, lambda: "no such CAN interface" in (bench.device.read().fault or ""), "to be told what is missing")
        bench.wire.trouble = bench.wire.missing = None
        bench.advance(0.5)
        recovers(bench)

    def test_a_full_bus(self, bench: DeviceBench, drives: Drives) -> None:
        """Another program sends all that fits: no order to stop finds room, and watchdogs stop the motors."""
        driving(bench)

        def flood() -> None:
            while bench.wire.put(Frame(0x1FFFFFFF, bytes(8), extended=True)):
                pass
            if bench.now < until:
                bench.clock.at(bench.now + 1e-3, flood)

        until = bench.now + 3.0
        flood()
        assert_latched(bench, drives, "")
        fault = bench.device.read().fault
        assert fault is not None
        assert "transmit queue is full" in fault or "no heartbeat" in fault
        bench.advance(max(0.0, until - bench.now) + 0.5)
        recovers(bench)

    def test_old_frames_in_the_queue_are_not_taken_for_new_ones(self, bench: DeviceBench, drives: Drives) -> None:
        """A process that was frozen finds heartbeats of before, of a drive that has died meanwhile."""
        driving(bench)
        bench.port.freeze()
        bench.clock.sleep(0.5)
        bench.cut()
        bench.clock.sleep(1.5)
        bench.port.thaw()
        wait(bench, lambda: bench.device.read().fault, "a fault")
        assert_latched(bench, drives, "no heartbeat")

    def test_frames_that_wait_to_be_read_are_not_missing(self, bench: DeviceBench, drives: Drives) -> None:
        """A process that was kept from running finds the heartbeats of a drive that is well, all of them."""
        driving(bench)
        bench.port.freeze()
        bench.clock.sleep(1.5)
        with pytest.raises(RobotError, match="nothing has been heard of the bus"):
            bench.device.drive(AHEAD)
        assert bench.device.read().fault is None
        bench.port.thaw()
        bench.advance(0.3)
        assert bench.device.read().fault is None
        assert not bench.device.read().armed, "the drives' watchdogs have stopped the motors meanwhile"
        gets_going(bench)


@pytest.mark.parametrize("protocol", NODES)
class Going:
    """A robot that drives, once with the drives of each protocol."""

    @pytest.fixture
    def drives(self, protocol: str) -> Iterator[Drives]:
        left, right = NODES[protocol]
        with Drives(protocol, [*left, *right]) as drives:
            yield drives

    @pytest.fixture
    def bench(self, protocol: str, drives: Drives) -> Iterator[DeviceBench]:
        bench = DeviceBench(protocol, *NODES[protocol])
        bench.device.start()
        gets_going(bench)
        yield bench
        bench.close()


class TestBusyPlayers(Going):
    """Whatever the drives speak, a process that does not run for a while is no fault, and hides none."""

    def test_nothing_is_wrong_after_it(self, bench: DeviceBench) -> None:
        for seconds in (0.1, 0.3, 0.45, 0.46, 0.47, 0.5, 0.51, 0.6, 1.0, 2.0):
            bench.port.freeze()
            bench.clock.sleep(seconds)
            bench.port.thaw()
            bench.advance(0.3)
            assert bench.device.read().fault is None, seconds
            gets_going(bench)

    def test_a_drive_that_died_meanwhile_is_missed(self, bench: DeviceBench, drives: Drives) -> None:
        bench.port.freeze()
        bench.cut()
        bench.clock.sleep(1.5)
        for _ in range(4):  # again and again it gets to run for a moment only
            bench.port.thaw()
            bench.advance(0.2)
            bench.port.freeze()
            bench.clock.sleep(0.4)
        bench.port.thaw()
        assert "no heartbeat" in (bench.device.read().fault or "")

    def test_a_bus_that_is_opened_after_all_is_closed_is_closed(
        self, bench: DeviceBench, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(bench.port, "restart", lambda: bench.clock.sleep(3.0))
        bench.recover()
        bench.advance(0.1)
        port = bench.port
        bench.device.close()
        bench.advance(5.0)
        with pytest.raises(RobotError, match="this one is closed"):
            port.send(codec.encode(0, messages.Estop()))


@pytest.mark.parametrize("protocol", NODES)
@pytest.mark.parametrize("watchdog", [0.0, 0.25])
def test_motors_are_switched_off_where_the_robots_own_thread_hangs(protocol: str, watchdog: float) -> None:
    """Whether the drives watch or not: the thread that hears the bus runs on."""
    left, right = NODES[protocol]
    with Drives(protocol, [*left, *right], watchdog=watchdog) as drives:
        bench = DeviceBench(protocol, left, right, **({} if watchdog else {"watchdog": "unsafe"}))
        try:
            bench.device.start()
            gets_going(bench)
            assert not at_rest(drives)
            bench.clock.sleep(COMMAND_TIMEOUT + 1.0)
            assert at_rest(drives)
            reading = bench.device.read()
            assert (reading.armed, reading.fault) == (False, None)
            with pytest.raises(RobotError, match=r"no setpoint came .*Arm again"):
                bench.device.drive(AHEAD)
            gets_going(bench)
        finally:
            bench.close()


class TestTurningOn(Going):
    """What a drive says is compared with what its encoder says, also where the motor is to be off."""

    def test_a_motor_that_turns_on_although_its_drive_says_that_it_is_off_is_told(self, bench: DeviceBench) -> None:
        node = bench.nodes[0]
        bench.fault(node, FaultKind.STUCK)
        bench.advance(0.05)
        bench.device.disarm()
        bench.advance(COAST_TIMEOUT + 0.1)
        assert f"node {node}: it turns at" in (bench.device.read().fault or "")
        bench.advance(1.0)
        assert not bench.driver._train._machine.guard.off, "the order is repeated"
        bench.fault(node, FaultKind.END)
        bench.advance(1.0)
        bench.recover()
        bench.advance(1.0)
        gets_going(bench)

    def test_a_robot_that_somebody_pushes_when_it_has_stood_is_no_fault(
        self, bench: DeviceBench, drives: Drives
    ) -> None:
        bench.device.disarm()
        wait(bench, lambda: at_rest(drives), "the motors to stand")
        for drive in drives.drives:
            drive.motor.velocity = 20.0
        bench.fault(bench.nodes[0], FaultKind.STUCK)
        bench.fault(bench.nodes[1], FaultKind.STUCK)
        bench.advance(3.0)
        assert bench.device.read().fault is None


@pytest.mark.parametrize(("protocol", "turns"), [("moteus", 65536.0), ("vesc", 2**32 / (6 * 7))])
def test_a_position_that_begins_anew_is_no_jump(protocol: str, turns: float) -> None:
    left, right = NODES[protocol]
    with Drives(protocol, [*left, *right]) as drives:
        bench = DeviceBench(protocol, left, right)
        try:
            drives.drives[0].motor.position = turns / 2 - 15.0
            bench.device.start()
            gets_going(bench)
            before = bench.odometry.pose
            for _ in range(60):
                bench.device.drive(AHEAD)
                bench.advance(0.05)
            assert drives.drives[0].motor.position > turns / 2
            assert bench.device.read().fault is None
            assert math.dist((before.x, before.y), (bench.odometry.pose.x, bench.odometry.pose.y)) > 0.5
        finally:
            bench.close()


@pytest.mark.parametrize("protocol", NODES)
def test_a_robot_drives_on_where_one_frame_in_ten_is_lost(protocol: str) -> None:
    rng = random.Random(1)
    with Drives(protocol, [node for side in NODES[protocol] for node in side]):
        bench = DeviceBench(protocol, *NODES[protocol])
        try:
            bench.device.start()
            gets_going(bench)
            bench.wire.tamper = lambda frame, _: [] if rng.random() < 0.1 else [(0.0, frame)]
            unarmed = 0
            for _ in range(300):
                bench.advance(0.1)
                reading = bench.device.read()
                assert reading.fault is None
                unarmed += not reading.armed
                with suppress(RobotError):
                    if reading.armed:
                        bench.device.drive(AHEAD)
                    else:
                        bench.device.arm()
            assert unarmed < 15
        finally:
            bench.close()


@pytest.mark.parametrize("broken", ["on_frame", "on_quiet", "on_trouble"])
def test_an_error_of_who_hears_is_trouble_of_the_bus(broken: str, drives: Drives) -> None:
    simulation, told = Simulation(), list[str]()

    def fail(_: object) -> None:
        raise ValueError("broken")

    bus = simulation.bus(LINK, **{"on_frame": lambda _: None, "on_trouble": told.append, broken: fail})
    bus.start()
    wire = simulation.wire(LINK)
    wire.put(Frame(1, b""))
    simulation.clock.sleep(0.2)
    wire.trouble = "the interface is down"
    simulation.clock.sleep(0.2)
    wire.trouble = None
    bus.send(Frame(1, b""))
    assert broken == "on_trouble" or "broken" in told[0]


def test_a_drive_of_another_robot_hides_nobodys_silence(bench: DeviceBench, drives: Drives) -> None:
    with Drives("odrive", [5], serial=0x77):
        driving(bench)
        bench.cut()
        assert_latched(bench, drives, "no heartbeat")


def test_a_process_that_does_not_run_does_nothing(bench: DeviceBench, drives: Drives) -> None:
    driving(bench)
    bench.port.freeze()
    bench.wire.trouble = "the interface is down"
    bench.clock.sleep(0.5)
    assert bench.driver._train._machine.guard.fault is None
    bench.wire.trouble = None
    bench.port.thaw()


def test_what_stops_motors_finds_room_where_other_frames_do_not(bench: DeviceBench, drives: Drives) -> None:
    bench.device.start()
    while bench.wire.put(codec.encode(0, messages.SetInputVel(0.0))):
        pass
    with pytest.raises(RobotError, match="the transmit queue is full"):
        bench.port.send(codec.encode(0, messages.SetInputVel(0.0)))
    bench.port.send(codec.encode(0, messages.Estop()), urgent=True)


def test_drives_that_are_put_back_on_a_bus_go_on(drives: Drives, lab: Simulation) -> None:
    heard: list[Frame] = []
    bus = lab.bus(LINK, heard.append)
    bus.start()
    lab.wire(LINK).detach(drives.drives)
    lab.clock.sleep(0.5)
    assert not heard
    lab.wire(LINK).attach(drives.drives)
    lab.clock.sleep(0.5)
    assert len(heard) > 50


class TestConnecting:
    """What is wrong before anything moves is said before anything is armed."""

    def test_a_wrong_node_id(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [0], [7])
        try:
            with pytest.raises(RobotError, match=rf"odrive node 7 on {INTERFACE}.*heard there: ODrive nodes 0, 1"):
                bench.device.start()
        finally:
            bench.close()

    def test_an_unknown_kind_of_interface(self) -> None:
        with pytest.raises(ConfigError, match=r"interface: expected one of .*, got 'tin-can'"):
            DeviceBench("odrive", [0], [1], interface="tin-can")

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


class TestProvedWatchdogs:
    """A drive is armed only if its watchdog lets a robot whose computer fails stand within REST."""

    REST = 0.45

    @pytest.mark.parametrize("watchdog", [0.05, 0.2, 0.25, 0.3, 0.35, 0.4, 0.6, 0.9])
    @pytest.mark.parametrize("protocol", ["odrive", "cia402", "vesc"])
    def test_whoever_is_armed_stands_soon_without_its_computer(self, protocol: str, watchdog: float) -> None:
        left, right = NODES[protocol]
        with Drives(protocol, [*left, *right], watchdog=watchdog) as drives:
            bench = DeviceBench(protocol, left, right)
            try:
                bench.device.start()
                end = bench.now + 5.0
                while bench.now < end and bench.speed < 0.6:
                    drive_on(bench, FAST, 0.02)
                fault = bench.device.read().fault
                assert (fault is None) == (bench.speed >= 0.6), fault
                if watchdog in (0.2, 0.25):
                    assert fault is None
                if protocol != "cia402" and watchdog >= 0.4:
                    assert "its own watchdog has not stopped it within 0.33 s" in (fault or "")
                if fault is None:
                    bench.device.drive(FAST)
                    bench.port.stop()
                    began = bench.now
                    bench.clock.wait(lambda: at_rest(drives), 5.0)
                    assert bench.now - began < self.REST
            finally:
                bench.port.start()
                bench.close()

    def test_one_whose_report_was_lost_is_tried_again(self, drives: Drives, bench: DeviceBench) -> None:
        bench.device.start()
        bench.advance(0.1)
        bench.device.arm()
        bench.advance(0.1)
        bench.fault(bench.nodes[0], FaultKind.SILENCE, 0.45)
        gets_going(bench)
        assert bench.device.read().fault is None


def test_a_robot_that_is_closed_while_it_is_recovered_keeps_its_bus_closed() -> None:
    """A recovery waits for the answers of drives for seconds; who closes the robot does not wait that long."""
    with Drives("cia402", [1, 2]):
        bench = DeviceBench("cia402", [1], [2])
        bench.device.start()
        starts, start = list[float](), bench.port.start

        def slow_restart() -> None:
            bench.driver.close()  # as another thread would, while this one opens the bus anew

        bench.port.restart = slow_restart  # type: ignore[method-assign]
        bench.port.start = lambda: (starts.append(bench.now), start())  # type: ignore[method-assign]
        bench.driver.recover()
        assert starts == [], "the bus was opened again"
        assert not bench.driver._train.connected
        with pytest.raises(RobotError, match="this one is closed"):
            bench.port.send(Frame(1, b""))


@pytest.mark.parametrize("protocol", NODES)
@pytest.mark.parametrize("under_way", [True, False])
def test_drives_that_hear_nothing_are_told_with_what_to_do(protocol: str, under_way: bool) -> None:
    """They report on, and a player goes on asking them to start."""
    left, right = NODES[protocol]
    with Drives(protocol, [*left, *right]) as drives:
        bench = DeviceBench(protocol, left, right)
        try:
            bench.device.start()
            if under_way:
                gets_going(bench)
            bench.wire.tamper = lambda frame, by_drive: [(0.0, frame)] if by_drive else []
            end = bench.now + 5.0
            while bench.now < end and not bench.device.read().fault:
                drive_on(bench)
            fault = bench.device.read().fault or ""
            told = ("does not hear this computer", "does it hear this computer", "no heartbeat", "it stands, though")
            assert any(words in fault for words in told), fault
            assert at_rest(drives)
        finally:
            bench.wire.tamper = None
            bench.close()


def test_encoder_messages_that_are_off_are_told_with_what_to_do(drives: Drives, bench: DeviceBench) -> None:
    driving(bench)
    off = codec.frame_id(1, messages.Command.ENCODER_ESTIMATES)
    bench.wire.tamper = lambda frame, by_drive: [] if frame.id == off else [(0.0, frame)]
    notices(bench)
    assert_latched(bench, drives, "node 1: no encoder message for 0.5 s, though it is alive: set axis0.config.can.enc")


def test_a_supply_that_is_no_battery_of_the_wiring_is_told_with_what_to_do() -> None:
    with Drives("odrive", [0, 1]) as drives:
        for drive in drives.drives:
            drive.options = replace(drive.options, voltage=12.0)
        bench = DeviceBench("odrive", [0], [1], supply=(20.0, 25.2))
        try:
            bench.device.start()
            notices(bench)
            assert "its supply has 12 V, where an empty battery has 20 V: is" in (bench.device.read().fault or "")
        finally:
            bench.close()


def test_frames_that_are_always_late_are_told_with_what_to_do(drives: Drives, bench: DeviceBench) -> None:
    """The adapter, or this computer, takes 0.3 s for each of them."""
    driving(bench)
    hear, waiting = bench.port.hear, list[tuple[float, Frame]]()

    def late(frame: Frame) -> None:
        waiting.append((bench.now, frame))
        while waiting and bench.now - waiting[0][0] >= 0.3:
            hear(waiting.pop(0)[1])

    bench.port.hear = late  # type: ignore[method-assign]
    bench.port._look_later = lambda _opened: None  # type: ignore[method-assign]
    notices(bench)
    assert "what is heard of the bus is 0.3" in (bench.device.read().fault or "")
    assert "Close other programs" in (bench.device.read().fault or "")
    wait(bench, lambda: at_rest(drives), "the motors to stand")
