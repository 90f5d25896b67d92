"""What goes wrong with a bus, or with those who share it: the robot stops, says why, and waits to be told to move."""

import math
import random
from contextlib import ExitStack, suppress
from dataclasses import replace

import pytest

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
from vrg.errors import RobotError
from vrg.hal.can.frame import Frame
from vrg.hal.can.judges.off import COAST_TIMEOUT
from vrg.hal.can.odrive import codec, messages
from vrg.hal.can.workshop.faults import FaultKind
from vrg.hal.can.workshop.simulation import Simulation
from vrg.hal.driver import COMMAND_TIMEOUT
from vrg.testing.can.bench import LINK, NODES, CanBench, DeviceBench, Drives
from vrg.testing.can.vcan import INTERFACE
from vrg.types import Twist

FAST = Twist(0.7, 0.0)
EVERY_PROTOCOL = pytest.mark.parametrize("protocol", NODES)


class TestEmergencyStop:
    """By the match's bus, by a frame, by a button at a drive."""

    @pytest.mark.parametrize("protocol", ["odrive", "cia402"])
    def test_a_button_at_a_drive_stops_all_and_needs_a_release(self, going: DeviceBench, drives: Drives) -> None:
        going.fault(1, FaultKind.ESTOP)
        wait(going, lambda: going.device.read().estop, "the stop to be seen")
        assert_latched(going, drives, "emergency stop")
        going.recover()
        going.device.read()
        going.advance(1.0)
        assert going.device.read().estop, "a recovery is no release"
        going.estop(False)
        going.device.read()
        going.advance(1.0)
        assert not going.device.read().estop
        assert not going.device.read().armed
        gets_going(going)

    def test_a_frame_of_another_master(self, going: DeviceBench, drives: Drives) -> None:
        going.inject(codec.encode(0, messages.Estop()))
        wait(going, lambda: going.device.read().estop, "the stop to be seen")
        assert_latched(going, drives, "emergency stop")

    @pytest.mark.parametrize("protocol", ["odrive", "cia402"])
    def test_it_waits_neither_for_a_tick_nor_for_the_drives_watchdogs(self, going: DeviceBench, drives: Drives) -> None:
        going.estop(True)  # no call of the robot follows
        assert going.clock.wait(lambda: not any(drive._energised for drive in drives.drives), 0.05)
        wait(going, lambda: at_rest(drives), "the motors to stand")

    def test_a_drive_that_was_stopped_before_is_not_armed(self, drives: Drives) -> None:
        with DeviceBench("odrive") as first:
            driving(first)
            first.estop(True)
            first.advance(0.3)
        with DeviceBench("odrive") as second:
            second.device.start()
            second.advance(0.7)
            assert second.device.read().estop
            with pytest.raises(RobotError, match="emergency"):
                second.device.arm()


@pytest.mark.parametrize("protocol", ["odrive", "cia402"])
def test_a_newcomer_listens_before_it_says_anything_and_the_first_one_notices_nothing(
    protocol: str, lab: Simulation, going: DeviceBench, drives: Drives
) -> None:
    errors: list[str] = []
    with CanBench(protocol) as second:

        def connect() -> None:
            try:
                second.driver.connect()
            except RobotError as error:
                errors.append(str(error))

        newcomer = lab.clock.spawn(connect, "newcomer")
        while newcomer.is_alive():
            drive_on(going)
        assert len(errors) == 1
        assert f"node {going.nodes[0]}: another program commands it too" in errors[0]
        for _ in range(10):
            drive_on(going)
        assert going.device.read().fault is None
        assert not at_rest(drives)


@pytest.mark.parametrize("watchdog", [0.0])
class TestUnwatched:
    """Drives without a watchdog, whose owner has said that this will do: nothing but an order stops them."""

    def test_nobody_who_has_not_said_so_arms_them(self, drives: Drives) -> None:
        with DeviceBench("odrive") as bench:
            bench.device.start()
            notices(bench)
            assert "its own watchdog has not stopped it" in bench.trouble
            assert at_rest(drives)

    def test_they_are_told_off_again_when_the_bus_is_back(self, going: DeviceBench, drives: Drives) -> None:
        going.wire.trouble = "the interface is down"
        wait(going, lambda: going.trouble, "a fault")
        going.advance(1.0)
        assert not at_rest(drives), "nothing has reached them"
        going.wire.trouble = None
        wait(going, lambda: at_rest(drives), "the motors to stand")
        going.advance(0.5)
        assert at_rest(drives)
        recovers(going)

    def test_a_drive_that_does_not_obey_is_a_fault_of_its_own(
        self, going: DeviceBench, drives: Drives, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(drives.drives[1], "_request", lambda _state, _now: None)
        going.device.disarm()
        wait(going, lambda: going.trouble, "a fault")
        assert going.trouble == "node 1: it is on, though it was ordered to be off: cut the power of its motor"
        assert going.device.read().latched


class TestInterface:
    """The interface itself goes, and comes back."""

    def test_nothing_passes_and_then_it_does_again(self, going: DeviceBench, drives: Drives) -> None:
        going.wire.trouble = "bus-off: too many errors"
        assert_latched(going, drives, "bus-off: too many errors")
        going.wire.trouble = None
        for _ in range(8):
            drive_on(going)
        assert going.trouble, "an interface that is back clears nothing"
        recovers(going)

    def test_deleted_and_made_again(self, going: DeviceBench, drives: Drives) -> None:
        going.wire.trouble = "the interface is gone"
        going.wire.missing = "no such CAN interface"
        assert_latched(going, drives, "the interface is ")
        going.recover()
        wait(going, lambda: "no such CAN interface" in going.trouble, "to be told what is missing")
        going.wire.trouble = going.wire.missing = None
        going.advance(0.5)
        recovers(going)

    def test_a_full_bus(self, going: DeviceBench, drives: Drives) -> None:
        """Another program sends all that fits: no order to stop finds room, and watchdogs stop the motors."""

        def flood() -> None:
            while going.wire.put(Frame(0x1FFFFFFF, bytes(8), extended=True)):
                pass
            if going.now < until:
                going.clock.at(going.now + 1e-3, flood)

        until = going.now + 3.0
        flood()
        assert_latched(going, drives, "")
        assert "transmit queue is full" in going.trouble or "no heartbeat" in going.trouble
        going.advance(max(0.0, until - going.now) + 0.5)
        recovers(going)


@EVERY_PROTOCOL
class TestBusyPlayers:
    """Whatever the drives speak, a process that does not run for a while is no fault, and hides none."""

    def test_nothing_is_wrong_after_it(self, going: DeviceBench) -> None:
        for seconds in (0.1, 0.3, 0.45, 0.46, 0.47, 0.5, 0.51, 0.6, 1.0, 2.0):
            going.port.freeze()
            going.clock.sleep(seconds)
            assert going.device.read().fault is None, seconds
            going.port.thaw()
            going.advance(0.3)
            assert going.device.read().fault is None, seconds
            assert seconds < 1.0 or not going.device.read().armed, "the drives' watchdogs have stopped the motors"
            gets_going(going)

    @pytest.mark.parametrize("orders", [1, 2, 5])
    def test_nothing_is_wrong_after_it_came_at_an_order_to_arm(self, bench: DeviceBench, orders: int) -> None:
        bench.device.start()
        for seconds in (1.0, 1.2, 2.0):
            for _ in range(orders - 1):
                drive_on(bench)
            with suppress(RobotError):
                bench.device.arm()
            bench.port.freeze()
            bench.clock.sleep(seconds)
            bench.port.thaw()
            gets_going(bench)
            assert not bench.trouble
            bench.device.disarm()
            bench.advance(0.5)

    def test_a_drive_that_died_meanwhile_is_missed(self, going: DeviceBench) -> None:
        """Heartbeats of before that wait to be read are not taken for new ones."""
        going.port.freeze()
        going.clock.sleep(0.5)
        going.cut()
        going.clock.sleep(1.5)
        for _ in range(4):  # again and again it gets to run for a moment only
            going.port.thaw()
            going.advance(0.2)
            going.port.freeze()
            going.clock.sleep(0.4)
        going.port.thaw()
        assert "no heartbeat" in going.trouble

    def test_a_bus_that_is_opened_after_all_is_closed_is_closed(
        self, going: DeviceBench, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(going.port, "restart", lambda: going.clock.sleep(3.0))
        going.recover()
        going.advance(0.1)
        port = going.port
        going.device.close()
        going.advance(5.0)
        with pytest.raises(RobotError, match="this one is closed"):
            port.send(codec.encode(0, messages.Estop()))


@EVERY_PROTOCOL
@pytest.mark.parametrize("watchdog", [0.0, 0.25])
def test_motors_are_switched_off_where_the_robots_own_thread_hangs(going: DeviceBench, drives: Drives) -> None:
    """Whether the drives watch or not: the thread that hears the bus runs on."""
    assert not at_rest(drives)
    going.clock.sleep(COMMAND_TIMEOUT + 1.0)
    assert at_rest(drives)
    reading = going.device.read()
    assert (reading.armed, reading.fault) == (False, None)
    with pytest.raises(RobotError, match=r"its motors were switched off, as no setpoint came for 0.2 s.*Arm again"):
        going.device.drive(AHEAD)
    gets_going(going)


@EVERY_PROTOCOL
class TestTurningOn:
    """What a drive says is compared with what its encoder says, also where the motor is to be off."""

    def test_a_motor_that_turns_on_although_its_drive_says_that_it_is_off_is_told(self, going: DeviceBench) -> None:
        node = going.nodes[0]
        going.fault(node, FaultKind.STUCK)
        going.advance(0.05)
        going.device.disarm()
        going.advance(COAST_TIMEOUT + 0.1)
        assert f"node {node}: it turns at" in going.trouble
        going.advance(1.0)
        assert not going.driver._machine.guard.off, "the order is repeated"
        going.fault(node, FaultKind.END)
        going.advance(1.0)
        going.recover()
        going.advance(1.0)
        gets_going(going)

    def test_one_that_is_pushed_when_it_has_stood_is_no_fault(self, going: DeviceBench, drives: Drives) -> None:
        going.device.disarm()
        wait(going, lambda: at_rest(drives), "the motors to stand")
        for drive in drives.drives:
            drive.motor.velocity = 20.0
        going.fault(going.nodes[0], FaultKind.STUCK)
        going.fault(going.nodes[1], FaultKind.STUCK)
        going.advance(3.0)
        assert going.device.read().fault is None


@pytest.mark.parametrize(("protocol", "turns"), [("moteus", 65536.0), ("vesc", 2**32 / (6 * 7))])
def test_a_position_that_begins_anew_is_no_jump(drives: Drives, bench: DeviceBench, turns: float) -> None:
    drives.drives[0].motor.position = turns / 2 - 15.0
    driving(bench)
    before = bench.odometry.pose
    for _ in range(60):
        bench.device.drive(AHEAD)
        bench.advance(0.05)
    assert drives.drives[0].motor.position > turns / 2
    assert bench.device.read().fault is None
    assert math.dist((before.x, before.y), (bench.odometry.pose.x, bench.odometry.pose.y)) > 0.5


@EVERY_PROTOCOL
def test_a_robot_drives_on_where_one_frame_in_ten_is_lost(going: DeviceBench) -> None:
    rng = random.Random(1)
    going.wire.tamper = lambda frame, _: [] if rng.random() < 0.1 else [(0.0, frame)]
    unarmed = 0
    for _ in range(300):
        drive_on(going)
        reading = going.device.read()
        assert reading.fault is None
        unarmed += not reading.armed
    assert unarmed < 15


@pytest.mark.parametrize("broken", ["on_frame", "on_quiet", "on_trouble"])
def test_an_error_of_who_hears_is_trouble_of_the_bus(broken: str) -> None:
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


def test_a_drive_of_another_robot_hides_nobodys_silence(going: DeviceBench, drives: Drives) -> None:
    with Drives("odrive", [5], serial=0x77):
        going.cut()
        assert_latched(going, drives, "no heartbeat")


def test_a_process_that_does_not_run_does_nothing(going: DeviceBench) -> None:
    going.port.freeze()
    going.wire.trouble = "the interface is down"
    going.clock.sleep(0.5)
    assert going.driver._machine.guard.fault is None
    going.wire.trouble = None
    going.port.thaw()


def test_what_stops_motors_finds_room_where_other_frames_do_not(bench: DeviceBench) -> None:
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


@pytest.mark.parametrize(
    ("there", "protocol", "sides", "words"),
    [
        (["odrive"], "odrive", ([0], [7]), rf"odrive node 7 on {INTERFACE}.*heard there: ODrive nodes 0, 1"),
        (["odrive"], "cia402", ([1], [2]), "cia402 nodes 1, 2.*heard there: ODrive nodes 0, 1"),
        (["cia402"], "odrive", ([1], [2]), "odrive nodes 1, 2.*heard there: CANopen nodes 1, 2"),
        (["odrive"] * 2, "odrive", ([0], [1]), "node 0: two drives have this id: serial numbers 1000 and 1010"),
        (["cia402"] * 2, "cia402", ([1], [2]), "node 1: .*id"),
    ],
    ids=["a wrong id", "of ODrive", "of CANopen", "two ODrives with one id", "two CANopen drives with one id"],
)
def test_what_is_wrong_with_the_drives_that_are_there_is_said_before_anything_is_armed(
    there: list[str], protocol: str, sides: tuple[list[int], list[int]], words: str
) -> None:
    with ExitStack() as stack:
        for number, kind in enumerate(there):
            stack.enter_context(Drives(kind, serial=0x1000 + 0x10 * number))
        bench = stack.enter_context(DeviceBench(protocol, *sides))
        with pytest.raises(RobotError, match=words):
            bench.device.start()


class TestProvedWatchdogs:
    """A drive is armed only if its watchdog lets a robot whose computer fails stand within REST."""

    REST = 0.45

    @pytest.mark.parametrize("watchdog", [0.05, 0.2, 0.25, 0.3, 0.35, 0.4, 0.6, 0.9])
    @pytest.mark.parametrize("protocol", ["odrive", "cia402", "vesc"])
    def test_whoever_is_armed_stands_soon_without_its_computer(
        self, protocol: str, watchdog: float, drives: Drives, bench: DeviceBench
    ) -> None:
        bench.device.start()
        end = bench.now + 5.0
        while bench.now < end and bench.speed < 0.6:
            drive_on(bench, FAST, 0.02)
        assert (not bench.trouble) == (bench.speed >= 0.6), bench.trouble
        if watchdog in (0.2, 0.25):
            assert not bench.trouble
        if protocol != "cia402" and watchdog >= 0.4:
            assert "its own watchdog has not stopped it within 0.33 s" in bench.trouble
        if not bench.trouble:
            bench.device.drive(FAST)
            bench.port.stop()
            began = bench.now
            bench.clock.wait(lambda: at_rest(drives), 5.0)
            assert bench.now - began < self.REST
        bench.port.start()

    def test_one_whose_report_was_lost_is_tried_again(self, bench: DeviceBench) -> None:
        bench.device.start()
        bench.advance(0.1)
        bench.device.arm()
        bench.advance(0.1)
        bench.fault(bench.nodes[0], FaultKind.SILENCE, 0.45)
        gets_going(bench)
        assert bench.device.read().fault is None


@pytest.mark.parametrize("protocol", ["cia402"])
def test_a_robot_that_is_closed_while_it_is_recovered_keeps_its_bus_closed(bench: DeviceBench) -> None:
    """A recovery waits for the answers of drives for seconds; who closes the robot does not wait that long."""
    bench.device.start()
    starts, start = list[float](), bench.port.start

    def slow_restart() -> None:
        bench.driver.close()  # as another thread would, while this one opens the bus anew

    bench.port.restart = slow_restart  # type: ignore[method-assign]
    bench.port.start = lambda: (starts.append(bench.now), start())  # type: ignore[method-assign]
    bench.driver.recover()
    assert starts == [], "the bus was opened again"
    assert not bench.driver.connected
    with pytest.raises(RobotError, match="this one is closed"):
        bench.port.send(Frame(1, b""))


class TestWithWhatToDo:
    """What a person can put right is told with what to do."""

    @EVERY_PROTOCOL
    @pytest.mark.parametrize("under_way", [True, False])
    def test_drives_that_hear_nothing(self, drives: Drives, bench: DeviceBench, under_way: bool) -> None:
        """They report on, and a player goes on asking them to start."""
        bench.device.start()
        if under_way:
            gets_going(bench)
        bench.wire.tamper = lambda frame, by_drive: [(0.0, frame)] if by_drive else []
        end = bench.now + 5.0
        while bench.now < end and not bench.trouble:
            drive_on(bench)
        told = ("does not hear this computer", "does it hear this computer", "no heartbeat", "it stands still, though")
        assert any(words in bench.trouble for words in told), bench.trouble
        assert at_rest(drives)
        bench.wire.tamper = None

    def test_encoder_messages_that_are_off(self, drives: Drives, going: DeviceBench) -> None:
        off = codec.frame_id(1, messages.Command.ENCODER_ESTIMATES)
        going.wire.tamper = lambda frame, by_drive: [] if frame.id == off else [(0.0, frame)]
        notices(going)
        assert_latched(going, drives, "node 1: no encoder message for 0.5 s, though it is alive: set axis0.config.can")

    def test_a_supply_that_is_no_battery_of_the_wiring(self, drives: Drives) -> None:
        for drive in drives.drives:
            drive.options = replace(drive.options, voltage=12.0)
        with DeviceBench("odrive", supply=(20.0, 25.2)) as bench:
            bench.device.start()
            notices(bench)
            assert "its supply has 12 V, where an empty battery has 20 V: is" in bench.trouble

    def test_frames_that_are_always_late(self, drives: Drives, going: DeviceBench) -> None:
        """The adapter, or this computer, takes 0.3 s for each of them."""
        hear, waiting = going.port.hear, list[tuple[float, Frame]]()

        def late(frame: Frame) -> None:
            waiting.append((going.now, frame))
            while waiting and going.now - waiting[0][0] >= 0.3:
                hear(waiting.pop(0)[1])

        going.port.hear = late  # type: ignore[method-assign]
        going.port._look_later = lambda _opened: None  # type: ignore[method-assign]
        notices(going)
        assert "what is heard from the bus is 0.3" in going.trouble
        assert "Close other programs" in going.trouble
        wait(going, lambda: at_rest(drives), "the motors to stand")
