"""Frames are sent no faster than the queue of an interface has room for them."""

import errno
import time

import can
import pytest

from vrg.errors import RobotError
from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.opening import frame_time
from vrg.hal.can.sending import MAX_IN_FLIGHT, Pacer

FRAME_TIME = 0.6e-3
"""s of a frame at 250 kbit/s."""
QUEUE = 10
"""The places in the queue of an interface, as Linux and our manual have it."""


class Wire:
    """A queue that is emptied one frame after the other at 250 kbit/s."""

    def __init__(self) -> None:
        self.pacer = Pacer(FRAME_TIME)
        self.now = 5.0
        self.leaves: list[float] = []
        self.fullest = 0

    def send(self, *, urgent: bool = False) -> None:
        if not urgent:
            self.now += self.pacer.delay(self.now)
        self.pacer.sent(self.now)
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
            assert wire.pacer.delay(wire.now) == 0.0
            wire.send()


def test_where_frames_take_no_time_none_waits() -> None:
    pacer = Pacer(0.0)
    for _ in range(1000):
        assert pacer.delay(5.0) == 0.0
        pacer.sent(5.0)


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
