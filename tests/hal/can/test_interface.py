"""What a real interface tells a bus: vcan0 is taken down, deleted, filled, and given error frames."""

import random
import socket
import struct
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest

from vrg.errors import RobotError
from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.clock import REAL_CLOCK
from vrg.testing.can.vcan import INTERFACE, VCAN

pytestmark = pytest.mark.vcan

PATIENCE = 60.0
"""s of real time for what a condition takes."""
_CAN_ERR_FLAG = 0x20000000


def ip(*arguments: str) -> None:
    """Do something to a network interface."""
    subprocess.run(["ip", *arguments], check=True, timeout=PATIENCE, capture_output=True)


def tc(*arguments: str) -> None:
    """Do something to the queue of the interface."""
    subprocess.run(["tc", "qdisc", *arguments], check=True, timeout=PATIENCE, capture_output=True)


@pytest.fixture(autouse=True)
def restored() -> Iterator[None]:
    """The interface is there and up again after the test."""
    yield
    for command in (("link", "add", INTERFACE, "type", "vcan"), ("link", "set", INTERFACE, "up")):
        with suppress(subprocess.CalledProcessError):
            ip(*command)
    with suppress(subprocess.CalledProcessError):
        tc("del", "dev", INTERFACE, "root")


class Ears:
    """A bus on the interface, and what it has told."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.troubles: list[str] = []
        self.quiet = 0
        self.bus = CanBus(VCAN, self.frames.append, self.troubles.append, self._be_quiet)

    def _be_quiet(self, _heard_until: float) -> None:
        self.quiet += 1


@pytest.fixture
def ears() -> Iterator[Ears]:
    ears = Ears()
    ears.bus.start()
    yield ears
    ears.bus.stop()


@pytest.fixture
def other() -> Iterator[CanBus]:
    """Another program on the bus."""
    bus = CanBus(VCAN, lambda _: None)
    bus.start()
    yield bus
    bus.stop()


def until(condition: Callable[[], object], what: str) -> None:
    assert REAL_CLOCK.wait(condition, PATIENCE), f"waited {PATIENCE:g} s for {what}"


def test_what_one_sends_the_other_hears_once_and_it_tells_when_all_is_heard(ears: Ears, other: CanBus) -> None:
    before = REAL_CLOCK.now()
    other.send(Frame(0x123, b"12345678"))
    other.send(Frame(0x1ABCDEF, b"", extended=True, remote=True))
    until(lambda: len(ears.frames) == 2, "two frames")
    assert [(f.id, f.data, f.extended, f.remote) for f in ears.frames] == [
        (0x123, b"12345678", False, False),
        (0x1ABCDEF, b"", True, True),
    ]
    assert all(before - 0.01 <= frame.at <= REAL_CLOCK.now() for frame in ears.frames)
    quiet = ears.quiet
    until(lambda: ears.quiet > quiet, "a quiet moment")
    assert not ears.troubles


def test_down_and_up(ears: Ears, other: CanBus) -> None:
    ip("link", "set", INTERFACE, "down")
    until(lambda: ears.troubles, "trouble")
    assert "the interface is down" in ears.troubles[0]
    with pytest.raises(RobotError, match="down"):
        ears.bus.send(Frame(1))
    down = CanBus(VCAN, lambda _: None)
    with suppress(RobotError):  # some kernels let a socket be bound to an interface that is down
        down.start()
        with pytest.raises(RobotError, match="down"):
            down.send(Frame(1))
    down.stop()
    ip("link", "set", INTERFACE, "up")
    other.send(Frame(2))
    until(lambda: ears.frames, "a frame")


def test_deleted_and_made_again(ears: Ears) -> None:
    ip("link", "del", INTERFACE)
    until(lambda: ears.troubles, "trouble")
    assert "the interface is " in ears.troubles[0]
    ears.bus.stop()
    with pytest.raises(RobotError, match="no such CAN interface on this machine"):
        ears.bus.start()
    ip("link", "add", INTERFACE, "type", "vcan")
    ip("link", "set", INTERFACE, "up")
    ears.bus.start()
    ears.bus.send(Frame(1))


def test_a_missing_interface() -> None:
    bus = CanBus(Link(channel="vcan77"), lambda _: None)
    with pytest.raises(RobotError, match=r"vcan77: no such CAN interface on this machine.*ip link add vcan77"):
        bus.start()


def send_many(bus: CanBus) -> None:
    for _ in range(100):
        bus.send(Frame(0x7FF, random.randbytes(8)))


def test_a_full_transmit_queue(ears: Ears) -> None:
    tc("add", "dev", INTERFACE, "root", "netem", "delay", "100s", "limit", "1")
    with pytest.raises(RobotError, match="queue is full"):
        send_many(ears.bus)


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        ((0x40, b""), "bus-off"),
        ((0x04, b"\0\x20"), "error-passive"),
        ((0x20, b""), "acknowledges"),
        ((0x04, b"\0\x08"), None),
        ((0x100, b""), None),
    ],
    ids=["bus-off", "passive", "no acknowledgement", "a warning", "restarted"],
)
def test_error_frames(ears: Ears, other: CanBus, frame: tuple[int, bytes], words: str | None) -> None:
    with socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.bind((INTERFACE,))
        raw.send(struct.pack("<IB3x8s", _CAN_ERR_FLAG | frame[0], 8, frame[1].ljust(8, b"\0")))
    other.send(Frame(1))
    until(lambda: ears.frames, "the frame after it")
    assert [words in trouble for trouble in ears.troubles if words] == [True] * (words is not None)
    assert bool(ears.troubles) == (words is not None)


def test_a_process_that_was_kept_from_running_finds_frames_as_old_as_they_are(other: CanBus) -> None:
    """More than the queue holds: what is lost is the newest."""
    frames: list[Frame] = []
    held = threading.Lock()

    def hear(frame: Frame) -> None:
        with held:
            frames.append(frame)

    bus = CanBus(VCAN, hear)
    bus.start()
    with held:
        sent = 0
        for number in range(30_000):
            with suppress(RobotError):
                other.send(Frame(1, struct.pack("<I", number)))
                sent += 1
        REAL_CLOCK.sleep(0.3)
        released = REAL_CLOCK.now()
    until(lambda: frames and frames[-1].id == 1 and len(frames) > 10, "what has waited")
    assert sent > 10_000
    assert frames[0].at < released - 0.25
    numbers = [int.from_bytes(frame.data, "little") for frame in frames[:10]]
    assert numbers == sorted(numbers)
    bus.stop()
