"""What goes wrong with vcan0, or with those who share it: the robot stops, says why, and waits to be told to move."""

import random
import socket
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest

from tests.hal.can.bench import LINK, NODES, PATIENCE, CanBench, DeviceBench, Drives
from tests.hal.can.handling import (
    AHEAD,
    assert_latched,
    at_rest,
    drive_on,
    driving,
    gets_going,
    recovers,
    wait,
)
from tests.vcan import INTERFACE
from vrg.errors import ConfigError, RobotError
from vrg.hal.can.bus import CanBus
from vrg.hal.can.emulator.faults import FaultKind
from vrg.hal.can.frame import Frame
from vrg.hal.can.odrive import codec, messages

pytestmark = pytest.mark.vcan

BUS_OFF, ERROR_PASSIVE, NO_ACK, RESTARTED = (0x40, b""), (0x04, b"\0\x20"), (0x20, b""), (0x100, b"")
_CAN_ERR_FLAG = 0x20000000


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


def error_frame(error_class: int, data: bytes) -> None:
    """What a controller's driver would put on the interface."""
    with socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.bind((INTERFACE,))
        raw.send(struct.pack("<IB3x8s", _CAN_ERR_FLAG | error_class, 8, data.ljust(8, b"\0")))


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

    def test_an_interface_that_is_down(self, drives: Drives) -> None:
        bench = DeviceBench("odrive", [0], [1])
        ip("link", "set", INTERFACE, "down")
        try:
            with pytest.raises(RobotError, match="down"):
                bench.device.start()
        finally:
            ip("link", "set", INTERFACE, "up")
            bench.close()


def fill(bench: DeviceBench) -> None:
    """Send until the queue is full."""
    bus = CanBus(LINK, lambda _: None)
    bus.start()
    try:
        for _ in range(100):
            bus.send(Frame(0x7FF, random.randbytes(8)))
    finally:
        bus.stop()
