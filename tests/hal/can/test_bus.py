"""A bus by python-can: who hears what, how fast frames are sent, how old they are, and which are one's own."""

import errno
import time
from collections.abc import Iterator

import can
import can.interfaces.virtual
import pytest

from vrg.errors import RobotError
from vrg.hal.can import bus as bus_module
from vrg.hal.can.bus import CanBus, Stamps
from vrg.hal.can.frame import Filter, Frame
from vrg.hal.can.link import Link
from vrg.hal.can.opening import frame_time
from vrg.hal.can.sending import MAX_IN_FLIGHT, Echoes, TokenBucket
from vrg.hal.clock import REAL_CLOCK
from vrg.testing.can.live import PATIENCE

LINK = Link(interface="virtual", channel="frames of others")


@pytest.mark.parametrize("wanted", [[Filter(0x10, 0x7FF)], None], ids=["filtered", "everything"])
def test_frames_of_others_do_not_hide_that_nothing_waits(wanted: list[Filter] | None) -> None:
    """Who is told of no frame must know that time passes, or it never finds that its own drives are silent."""
    heard: list[Frame] = []
    quiet: list[float] = []
    bus = CanBus(LINK, heard.append, on_quiet=quiet.append)
    other = CanBus(LINK, lambda _: None)
    bus.listen_to(wanted)
    bus.start()
    other.start()
    try:
        began = REAL_CLOCK.now()

        def enough() -> bool:
            other.send(Frame(0x20))
            return len(quiet) > 3 if wanted else len(heard) > 10

        assert REAL_CLOCK.wait(enough, PATIENCE)
        assert bool(heard) == (wanted is None)
        assert quiet == sorted(quiet)
        assert all(began <= at <= REAL_CLOCK.now() for at in quiet)
    finally:
        bus.stop()
        other.stop()


@pytest.fixture
def unknown(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[CanBus, CanBus, list[Frame]]]:
    """Two buses by an interface of which it is not known whether it gives frames back, and what the first one hears."""
    monkeypatch.setattr(bus_module, "_QUIET", frozenset())
    heard: list[Frame] = []
    bus, other = CanBus(LINK, heard.append), CanBus(LINK, lambda _: None)
    bus.start()
    other.start()
    yield bus, other, heard
    bus.stop()
    other.stop()


def test_an_adapter_that_gives_back_own_frames_is_found_out_by_the_first(
    unknown: tuple[CanBus, CanBus, list[Frame]],
) -> None:
    """Else each setpoint would look like that of another program."""
    bus, other, heard = unknown
    assert isinstance(bus._bus, can.interfaces.virtual.VirtualBus)
    bus._bus.receive_own_messages = True
    for number in range(5):
        bus.send(Frame(0x10, bytes([number])))
    other.send(Frame(0x20))
    other.send(Frame(0x10, b"\x02"))
    assert REAL_CLOCK.wait(lambda: len(heard) >= 2, PATIENCE)
    assert [(frame.id, frame.data) for frame in heard] == [(0x20, b""), (0x10, b"\x02")]


def test_one_that_does_not_hides_no_stranger(
    unknown: tuple[CanBus, CanBus, list[Frame]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not even where its first frame could not be sent, and a stranger asks the same as the next one."""
    bus, other, heard = unknown
    assert bus._bus is not None
    with monkeypatch.context() as context:
        context.setattr(bus._bus, "send", lambda _: (_ for _ in ()).throw(can.CanError("broken")))
        with pytest.raises(RobotError, match="broken"):
            bus.send(Frame(0x10, b"\x01"))
    bus.send(Frame(0x10, b"\x01"))
    other.send(Frame(0x10, b"\x01"))
    bus.send(Frame(0x10, b"\x02"))
    began = REAL_CLOCK.now()

    def hears() -> bool:
        bus.send(Frame(0x10, b"\x03"))
        other.send(Frame(0x10, b"\x03"))
        return REAL_CLOCK.now() - began > 2 * bus_module._ECHO_TIMEOUT

    assert REAL_CLOCK.wait(hears, PATIENCE)
    heard.clear()
    bus.send(Frame(0x10, b"\x04"))
    other.send(Frame(0x10, b"\x04"))
    assert REAL_CLOCK.wait(lambda: Frame(0x10, b"\x04").data in [frame.data for frame in heard], PATIENCE)


FRAME_TIME = 0.6e-3
"""s of a frame at 250 kbit/s."""
QUEUE = 10
"""The places in the queue of an interface, as Linux and our manual have it."""


class Wire:
    """A queue that is emptied one frame after the other at 250 kbit/s."""

    def __init__(self) -> None:
        self.bucket = TokenBucket(FRAME_TIME)
        self.now = 5.0
        self.leaves: list[float] = []
        self.fullest = 0

    def send(self, *, urgent: bool = False) -> None:
        if not urgent:
            self.now += self.bucket.delay(self.now)
        self.bucket.sent(self.now)
        last = self.leaves[-1] if self.leaves else 0.0
        self.leaves.append(max(last, self.now) + FRAME_TIME)
        self.fullest = max(self.fullest, sum(leaves > self.now for leaves in self.leaves))


def test_four_motors_are_armed_without_filling_the_queue() -> None:
    wire = Wire()
    for _ in range(4 * 6):
        wire.send()
    assert wire.fullest <= MAX_IN_FLIGHT
    assert wire.now - 5.0 < 0.02


@pytest.mark.parametrize("before", range(30))
def test_there_is_always_room_to_stop_four_motors_at_once(before: int) -> None:
    wire = Wire()
    for _ in range(before):
        wire.send()
    began = wire.now
    for _ in range(4):
        wire.send(urgent=True)
    assert wire.now == began
    assert wire.fullest <= QUEUE


def test_setpoints_in_their_rhythm_never_wait() -> None:
    wire = Wire()
    for tick in range(100):
        wire.now = 5.0 + 0.02 * tick
        for _ in range(4):
            assert wire.bucket.delay(wire.now) == 0.0
            wire.send()


def test_where_frames_take_no_time_none_waits() -> None:
    bucket = TokenBucket(0.0)
    for _ in range(1000):
        assert bucket.delay(5.0) == 0.0
        bucket.sent(5.0)


BITTIMING = '[{"linkinfo": {"info_kind": "can", "info_data": {"state": "STOPPED", "bittiming": {"bitrate": 500000}}}}]'


@pytest.mark.parametrize(
    ("link", "said", "time_of_a_frame"),
    [
        (Link(interface="slcan", bitrate=1_000_000), None, 0.15e-3),
        (Link(interface="slcan"), None, 0.6e-3),
        (Link(interface="virtual"), None, 0.0),
        (Link(interface="udp_multicast"), None, 0.0),
        (Link(channel="can0"), BITTIMING, 0.3e-3),
        (Link(channel="can0", bitrate=250_000), BITTIMING, 0.6e-3),
        (Link(channel="vcan0"), '[{"linkinfo": {"info_kind": "vcan"}}]', 0.0),
        (Link(channel="vcan0", bitrate=250_000), '[{"linkinfo": {"info_kind": "vcan"}}]', 0.6e-3),
        (Link(channel="slcan0"), "[{}]", 0.6e-3),
        (Link(channel="slcan0"), None, 0.6e-3),
    ],
)
def test_a_frame_takes_as_long_as_the_bit_rate_says(
    link: Link, said: str | None, time_of_a_frame: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrg.hal.can.opening._run", lambda _: said)
    assert frame_time(link) == pytest.approx(time_of_a_frame)


def full(times: int) -> tuple[CanBus, list[can.Message]]:
    """A bus whose queue is full so many times, and what it has sent."""
    bus = CanBus(Link(interface="virtual", channel="full"), lambda _: None)
    bus.start()
    sent: list[can.Message] = []
    left = [times]

    def send(message: can.Message, timeout: float | None = None) -> None:
        if left[0]:
            left[0] -= 1
            raise can.CanOperationError("full", error_code=errno.ENOBUFS)
        sent.append(message)

    assert bus._bus is not None
    bus._bus.send = send  # type: ignore[method-assign]
    return bus, sent


def test_a_queue_that_others_have_filled_is_waited_for() -> None:
    bus, sent = full(3)
    try:
        bus.send(Frame(1))
    finally:
        bus.stop()
    assert len(sent) == 1


def test_a_queue_that_nobody_empties_is_an_error_soon() -> None:
    bus, sent = full(1_000_000)
    began = time.monotonic()
    try:
        with pytest.raises(RobotError, match="the transmit queue is full"):
            bus.send(Frame(1), urgent=True)
    finally:
        bus.stop()
    assert not sent
    assert time.monotonic() - began < 5.0


DAY = 1.8e9
"""The time of day when the monotonic clock was 0, s."""


@pytest.fixture
def stamps() -> Stamps:
    """After a while in which nobody has set the clock."""
    stamps = Stamps()
    for tick in range(100):
        now = 0.1 * tick
        stamps.age(DAY + now, DAY + now, now)
    return stamps


def test_a_frame_is_as_old_as_it_has_waited(stamps: Stamps) -> None:
    assert stamps.age(DAY + 9.2, DAY + 10.0, 10.0) == pytest.approx(0.8, abs=1e-6)
    assert stamps.age(DAY + 10.0, DAY + 10.0, 10.0) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("step", [0.5, 3600.0, -0.5, -3600.0])
def test_a_clock_that_is_set_makes_no_frame_old(stamps: Stamps, step: float) -> None:
    """Neither one that was stamped before, nor those that follow."""
    assert stamps.age(DAY + 9.99, DAY + step + 10.0, 10.0) < 0.02
    for tick in range(1, 50):
        now = 10.0 + 0.1 * tick
        assert stamps.age(DAY + step + now, DAY + step + now, now) < 0.02


@pytest.mark.parametrize("step", [0.5, -0.5])
def test_a_second_after_that_a_freeze_is_noticed_again(stamps: Stamps, step: float) -> None:
    stamps.age(DAY + step + 10.0, DAY + step + 10.0, 10.0)
    stamps.age(DAY + step + 11.5, DAY + step + 11.5, 11.5)
    assert stamps.age(DAY + step + 12.0, DAY + step + 12.8, 12.8) == pytest.approx(0.8, abs=1e-6)


def test_a_freeze_alone_is_no_clock_that_is_set(stamps: Stamps) -> None:
    assert stamps.age(DAY + 10.0, DAY + 13.0, 13.0) == pytest.approx(3.0, abs=1e-6)


ONE, OTHER = Frame(0x101, b"\1"), Frame(0x102, b"\1")


def test_each_comes_back_once() -> None:
    echoes = Echoes()
    echoes.sent(ONE, 1.0)
    echoes.sent(ONE, 1.1)
    assert not echoes.returns(OTHER, 1.2)
    assert [echoes.returns(ONE, 1.2) for _ in range(3)] == [True, True, False]


@pytest.mark.parametrize(
    "stranger", [Frame(0x101, b"\2"), Frame(0x101, b"\1", remote=True), Frame(0x101, b"\1", extended=True)]
)
def test_another_frame_of_the_same_identifier_is_a_stranger(stranger: Frame) -> None:
    echoes = Echoes()
    echoes.sent(ONE, 1.0)
    assert not echoes.returns(stranger, 1.0)


def test_one_that_never_came_back_hides_no_stranger_for_long() -> None:
    echoes = Echoes()
    echoes.sent(ONE, 1.0)
    echoes.sent(ONE, 1.9)
    assert echoes.returns(ONE, 2.5)
    assert not echoes.returns(ONE, 2.5), "the first one is forgotten"
    assert not echoes.returns(ONE, 9.0)
    assert not echoes._expected, "nothing is kept for ever"


def test_what_was_sent_and_came_back_long_ago_leaves_nothing() -> None:
    echoes = Echoes()
    for tick in range(1000):
        echoes.sent(ONE, 0.1 * tick)
        assert echoes.returns(ONE, 0.1 * tick + 0.01)
    assert len(echoes._sent) < 20


def test_a_bus_that_echoes_tells_only_what_others_say() -> None:
    heard: list[Frame] = []
    bus = CanBus(Link(interface="virtual", channel="echoes", adapter={"receive_own_messages": True}), heard.append)
    other = CanBus(Link(interface="virtual", channel="echoes"), lambda _: None)
    bus.start()
    other.start()
    try:
        for _ in range(5):
            bus.send(ONE)
        other.send(ONE)
        other.send(OTHER)
        assert REAL_CLOCK.wait(lambda: len(heard) >= 2, PATIENCE)
    finally:
        bus.stop()
        other.stop()
    assert [frame.id for frame in heard] == [ONE.id, OTHER.id]
