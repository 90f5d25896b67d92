"""Counting what is heard on the bus of a match."""

import pytest

from vrg.bus import messages as m
from vrg.bus.codec import Received, encode
from vrg.bus.topics import Keys
from vrg_views.developer.traffic import SPAN, Traffic

KEYS = Keys("test")


class Link:
    """A match's bus, with a clock in the hands of the test."""

    def __init__(self) -> None:
        self.now = 100.0
        self.traffic = Traffic(KEYS, lambda: self.now)

    def say(self, sequence: int, forward: float = 0.5, key: str = "") -> int:
        """Let a message come; its size in bytes."""
        key = key or KEYS.manual("ann").key
        payload = encode(Received(key, self.now - 90.0, sequence, m.Manual(forward=forward, turn=0.0, lease=0.5)))
        self.traffic.arrived(key, payload)
        return len(payload)


@pytest.fixture
def link():
    return Link()


def test_rate_bandwidth_and_age_are_those_of_the_last_seconds(link):
    for number in range(200):
        link.now += 0.05
        size = link.say(number)
        link.traffic.look()
    (stream,) = link.traffic.look()
    assert stream.key == "player/ann/manual"
    assert stream.rate == pytest.approx(20.0, rel=0.1)
    assert stream.bandwidth == pytest.approx(20.0 * size, rel=0.1)
    assert stream.longest == pytest.approx(0.05)
    link.now += 3.0
    (stream,) = link.traffic.look()
    assert stream.age == pytest.approx(3.0)
    assert stream.rate < 5.0


def test_numbers_that_are_missing_were_lost(link):
    for number in (0, 1, 4, 5):
        link.now += 0.3
        link.say(number)
    (stream,) = link.traffic.look()
    assert (stream.lost, stream.lately) == (2, 2)
    for _ in range(2):
        link.now += SPAN
        (stream,) = link.traffic.look()
    assert (stream.lost, stream.lately) == (2, 0)


def test_a_sender_that_has_begun_anew_has_lost_nothing(link):
    for number in (7, 8, 0, 1):
        link.say(number)
    assert link.traffic.look()[0].lost == 0


def test_the_newest_message_of_each_key_is_decoded_on_demand(link):
    link.say(0, 0.1)
    link.say(1, 0.2)
    link.say(0, 0.3, KEYS.manual("bob").key)
    found = link.traffic.newest(KEYS.manual())
    assert [(message.key, message.sequence, message.body.forward) for message in found] == [
        (KEYS.manual("ann").key, 1, 0.2),
        (KEYS.manual("bob").key, 0, 0.3),
    ]
    assert link.traffic.newest(KEYS.manual("ann"))[0] is found[0], "it is decoded once"
    assert link.traffic.newest(KEYS.report()) == []


def test_what_is_no_message_is_counted_and_loses_nothing(link):
    link.say(0, 0.1)
    link.traffic.arrived(KEYS.manual("ann").key, b"\xc1")
    key = KEYS.report("ann").key
    link.traffic.arrived(key, encode(Received(key, 1.0, 0, m.Estop(by="x"))))
    assert link.traffic.newest(KEYS.report()) == []
    assert [stream.bad for stream in link.traffic.look()] == [1, 1]
    assert link.traffic.newest(KEYS.manual())[0].body.forward == 0.1


def test_after_more_than_can_wait_nothing_is_counted_as_lost(monkeypatch):
    monkeypatch.setattr("vrg_views.developer.traffic.QUEUE_SIZE", 3)
    waiting, closed = [], []

    class Bus:
        def collect_raw(self, expression, limit):
            assert (expression, limit) == ("vrg/test/**", 3)
            return self

        def __call__(self):
            return [waiting.pop(0) for _ in range(min(3, len(waiting)))]

        def close(self):
            closed.append(True)

    traffic = Traffic(KEYS, lambda: 0.0)
    traffic.attach(Bus())

    def say(*numbers):
        manual = m.Manual(forward=0.5, turn=0.0, lease=0.5)
        key = KEYS.manual("ann").key
        waiting.extend((key, encode(Received(key, 1.0, number, manual))) for number in numbers)
        traffic.take()

    say(0)
    assert traffic.look() == [], "it listens while it is open"
    traffic.open()
    traffic.open()
    traffic.take()
    say(1)
    say(2, 4)
    say(9, 10, 11)
    say(12)
    traffic._looked = -1.0
    assert traffic.look()[0].lost == 1
    traffic.close()
    traffic.close()
    assert (traffic.look(), closed) == ([], [True])


def test_what_was_published_on_another_key_is_counted_and_nothing_else(link):
    key, other = KEYS.manual("ann").key, KEYS.manual("bob").key
    link.say(0)
    link.traffic.arrived(key, encode(Received(other, 10.0, 7, m.Manual(forward=0.9, turn=0.0, lease=0.5))))
    link.now += 1.0
    [stream] = link.traffic.look()
    assert (stream.misrouted, stream.bad, stream.lost) == (1, 0, 0)
    [newest] = link.traffic.newest(KEYS.manual("ann"))
    assert newest.body.forward == 0.5
