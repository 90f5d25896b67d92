"""Own frames that come back, and strangers' that look the same."""

import time

import pytest

from tests.hal.can.bench import PATIENCE
from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.hal.can.link import Link
from vrg.hal.can.sending import Echoes

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
        deadline = time.monotonic() + PATIENCE
        while len(heard) < 2:
            assert time.monotonic() < deadline
            time.sleep(0.01)
    finally:
        bus.stop()
        other.stop()
    assert [frame.id for frame in heard] == [ONE.id, OTHER.id]
