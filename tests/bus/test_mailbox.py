"""What a node sees between two ticks."""

import logging

import pytest

from tests.bus.bench import KEYS, call
from vrg.bus import messages as m
from vrg.bus.codec import Header, Received, encode, header
from vrg.bus.mailbox import KEYS_LIMIT, QUEUE_LIMIT, Inlet, Mailbox, Numbers, Origin
from vrg.types import Twist


def _drive(robot: str, stamp: float, sequence: int, left: float = 0.0) -> Received[m.Drive]:
    return Received(KEYS.drive(robot).key, stamp, sequence, m.Drive(twist=Twist(left, 0.0)))


def _call(number: int, stamp: float = 0.0, sender: str = "") -> Received[m.Call]:
    return Received(KEYS.referee_event.key, stamp, number, call(number), sender)


@pytest.fixture
def drives() -> Inlet[m.Drive]:
    return Inlet(KEYS.drive())


@pytest.fixture
def calls() -> Inlet[m.Call]:
    return Inlet(KEYS.referee_event)


def _head(message: Received[m.Message]) -> Header:
    return header(encode(message), message.key)


def taken(inlet: Inlet[m.Call]) -> list[int]:
    inlet.handover()
    return [message.body.number for message in inlet.take()]


def test_nothing_is_seen_before_the_handover(drives: Inlet[m.Drive]) -> None:
    drives.offer(_drive("a", 0.0, 0))
    assert drives.latest is None
    assert drives.take() == []
    drives.handover()
    assert drives.latest is not None
    assert len(drives.take()) == 1
    assert drives.take() == []


def test_of_a_sensor_only_the_newest_is_kept_for_each_key_though_the_node_never_takes(drives: Inlet[m.Drive]) -> None:
    for i in range(5):
        drives.offer(_drive("a", i * 0.1, i, left=i))
        drives.offer(_drive("b", i * 0.1, i, left=-i))
        if i < 3:
            drives.handover()
    drives.handover()
    assert [r.body.twist.v for r in drives.take()] == [4, -4]
    assert drives.by_key[KEYS.drive("a").key].body.twist.v == 4


def test_every_event_arrives_in_the_order_of_stamp_sender_and_number(calls: Inlet[m.Call]) -> None:
    for i in (3, 1, 2):
        calls.offer(_call(i))
    calls.handover()
    calls.offer(_call(4))
    assert taken(calls) == [1, 2, 3, 4]
    calls.offer(_call(5, stamp=2.0))
    calls.offer(_call(9, stamp=1.0))
    assert taken(calls) == [9, 5]
    for end in ("", "/3f60c1d2"):
        senders = ("player/ann", "player/ann-b", "player/bob")
        wanted = [_call(number, 3.0, sender + end) for sender in senders for number in (0, 1)]
        for message in reversed(wanted):
            calls.offer(message)
        calls.handover()
        assert calls.take() == wanted


def test_a_queue_of_events_is_bounded_and_says_what_it_lost(calls: Inlet[m.Call]) -> None:
    for i in range(QUEUE_LIMIT + 7):
        calls.offer(_call(i))
    assert taken(calls)[0] == calls.dropped == 7


def test_a_bad_message_is_dropped_and_the_next_good_one_arrives(
    drives: Inlet[m.Drive], caplog: pytest.LogCaptureFixture
) -> None:
    key = KEYS.drive("a").key
    with caplog.at_level(logging.WARNING):
        for _ in range(2000):
            drives.offer_header(_head(Received(key, 0.5, 2, m.Estop(by="a"))))
    drives.offer_header(_head(Received(key, 0.5, 3, m.Drive(twist=Twist(1.0, 1.0)))))
    drives.handover()
    assert drives.dropped == 2000
    assert drives.latest is not None
    assert drives.latest.body.twist.v == 1.0
    assert len(caplog.records) < 12, "the log must not be flooded"
    assert key in caplog.records[0].getMessage()


def test_published_messages_are_stamped_and_counted_by_key() -> None:
    mailbox = Mailbox()
    mailbox.handover(1.5)
    for robot in "aba":
        mailbox.publish(KEYS.drive(robot), m.Drive(twist=Twist(0.0, 0.0)))
    out = [(o.message.key[-7:], o.message.stamp, o.message.sequence) for o in mailbox.collect()]
    assert out == [("a/drive", 1.5, 0), ("b/drive", 1.5, 0), ("a/drive", 1.5, 1)]
    assert mailbox.collect() == []


def test_an_alarm_is_raised_at_once_and_the_message_still_handed_over() -> None:
    heard: list[float] = []
    mailbox = Mailbox()
    inlet = mailbox.subscribe(KEYS.estop, alarm=lambda received: heard.append(received.stamp))
    quiet = mailbox.subscribe(KEYS.estop)
    for number, stamp in enumerate((1.0, 2.0)):
        message = Received(KEYS.estop.key, stamp, number, m.Estop(by="t"))
        inlet.offer(message)
        quiet.offer(message)
    assert heard == [1.0, 2.0]
    assert inlet.take() == []
    mailbox.handover(2.0)
    assert heard == [1.0, 2.0]
    assert len(inlet.take()) == len(quiet.take()) == 2


def _heard(inlet: Inlet[m.Call], *steps: tuple[int, Origin, str]) -> list[int]:
    for number, origin, sender in steps:
        inlet.offer_header(_head(_call(number, 1.0, sender)), origin)
    return taken(inlet)


def test_an_event_that_comes_twice_is_handed_over_once(calls: Inlet[m.Call]) -> None:
    """However it came first, and also if the process that repeats it is asked for it besides."""
    live, repeated, asked = ((origin, "coordinator/referee/1") for origin in Origin)
    assert _heard(calls, (0, *live), (1, *live), (1, *asked), (1, *live), (1, *repeated), (2, *asked)) == [0, 1, 2]
    assert _heard(calls, (2, *live), (3, *repeated), (3, *asked), (4, *live)) == [3, 4]


def test_a_sender_that_begins_anew_is_heard_and_old_events_of_a_stranger_not(calls: Inlet[m.Call]) -> None:
    old, new = "coordinator/referee/1", "coordinator/referee/2"
    assert _heard(calls, (7, Origin.LIVE, old), (0, Origin.LIVE, new), (1, Origin.REPEATED, new)) == [7, 0, 1]
    assert _heard(calls, (5, Origin.ASKED, "coordinator/other/1")) == []
    assert _heard(calls, (6, Origin.REPEATED, "coordinator/other/1")) == [6], "it may have been published just now"


def test_what_has_an_alarm_counts_whatever_the_number_of_its_message() -> None:
    """A simple program that engages the emergency stop may number all of its messages alike."""
    sounded: list[int] = []
    inlet = Inlet(KEYS.estop, lambda message: sounded.append(message.sequence))
    head = _head(Received(KEYS.estop.key, 0.0, 3, m.Estop(by="button"), "official/button/1"))
    for origin in (Origin.LIVE, Origin.LIVE, Origin.REPEATED, Origin.ASKED):
        inlet.offer_header(head, origin)
    assert sounded == [], "the executor has sounded it when it arrived"
    inlet.sound(head)
    assert sounded == [3]
    inlet.handover()
    assert len(inlet.take()) == 2


def test_the_numbers_of_invented_senders_fill_no_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.bus.mailbox.SENDERS_LIMIT", 3)
    numbers = Numbers()
    for sender in range(100):
        assert numbers.is_new(_head(_call(1, 1.0, f"coordinator/{sender}/1")), Origin.LIVE)
    assert len(numbers._newest) <= 3


def test_keys_that_somebody_invents_fill_no_memory_and_cost_others_nothing(drives: Inlet[m.Drive]) -> None:
    assert drives.admits(KEYS.drive("a").key)
    invented = [KEYS.drive(f"x{number}").key for number in range(5 * KEYS_LIMIT)]
    assert sum(map(drives.admits, invented)) == KEYS_LIMIT - 1
    assert drives.admits(KEYS.drive("a").key)
    assert drives.dropped == len(invented) - KEYS_LIMIT + 1


def test_where_the_keys_are_known_no_other_counts() -> None:
    ann = KEYS.report("ann").key
    inlet = Mailbox().subscribe(KEYS.report(), only=[ann])
    assert not inlet.admits(KEYS.report("bob").key)
    assert inlet.admits(ann)
    assert inlet.dropped == 0
