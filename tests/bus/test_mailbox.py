"""What a node sees between two ticks."""

import logging

import pytest

from vrg.bus import messages as m
from vrg.bus.codec import Received, encode, header
from vrg.bus.mailbox import KEYS_LIMIT, QUEUE_LIMIT, Inlet, Mailbox, Numbers, Origin
from vrg.bus.topics import Keys
from vrg.types import Twist

KEYS = Keys("m")


def _drive(robot: str, stamp: float, sequence: int, left: float = 0.0) -> Received[m.Drive]:
    return Received(KEYS.drive(robot).key, stamp, sequence, m.Drive(twist=Twist(left, 0.0)))


def _call(number: int, stamp: float = 0.0) -> Received[m.Call]:
    call = m.Call(number=number, rule="r", text="", players=(), poses=(), clock=0.0)
    return Received(KEYS.referee_event.key, stamp, number, call)


def test_nothing_is_seen_before_the_handover() -> None:
    inlet = Inlet(KEYS.drive())
    inlet.offer(_drive("a", 0.0, 0))
    assert inlet.latest is None
    assert inlet.take() == []
    inlet.handover()
    assert inlet.latest is not None
    assert len(inlet.take()) == 1
    assert inlet.take() == []


def test_of_a_sensor_only_the_newest_is_kept_for_each_key() -> None:
    inlet = Inlet(KEYS.drive())
    for i in range(5):
        inlet.offer(_drive("a", i * 0.1, i, left=i))
        inlet.offer(_drive("b", i * 0.1, i, left=-i))
    inlet.handover()
    assert [r.body.twist.v for r in inlet.take()] == [4, -4]
    assert inlet.by_key[KEYS.drive("a").key].body.twist.v == 4


def test_of_a_sensor_nothing_piles_up_for_a_node_that_never_takes() -> None:
    inlet = Inlet(KEYS.drive())
    for i in range(1000):
        inlet.offer(_drive("a", i, i))
        inlet.handover()
    assert len(inlet.take()) == 1


def test_every_event_arrives_in_order() -> None:
    inlet = Inlet(KEYS.referee_event)
    for i in (3, 1, 2):
        inlet.offer(_call(i))
    inlet.handover()
    inlet.offer(_call(4))
    inlet.handover()
    assert [r.body.number for r in inlet.take()] == [1, 2, 3, 4]


def test_events_are_ordered_by_stamp_before_sequence() -> None:
    inlet = Inlet(KEYS.referee_event)
    inlet.offer(_call(5, stamp=2.0))
    inlet.offer(_call(9, stamp=1.0))
    inlet.handover()
    assert [r.body.number for r in inlet.take()] == [9, 5]


def test_a_queue_of_events_is_bounded_and_says_what_it_lost() -> None:
    inlet = Inlet(KEYS.referee_event)
    for i in range(QUEUE_LIMIT + 7):
        inlet.offer(_call(i))
    inlet.handover()
    assert inlet.dropped == 7
    assert inlet.take()[0].body.number == 7


def test_a_bad_message_is_counted_and_dropped_and_the_next_good_one_arrives(caplog: pytest.LogCaptureFixture) -> None:
    inlet = Inlet(KEYS.drive())
    key = KEYS.drive("a").key
    junk = header(encode(Received(key, 0.5, 2, m.Estop(by="a"))), key)
    with caplog.at_level(logging.WARNING):
        for _ in range(2000):
            inlet.offer_header(junk)
    inlet.offer_header(header(encode(Received(key, 0.5, 3, m.Drive(twist=Twist(1.0, 1.0)))), key))
    inlet.handover()
    assert inlet.dropped == 2000
    assert inlet.latest is not None
    assert inlet.latest.body.twist.v == 1.0
    assert len(caplog.records) < 12, "the log must not be flooded"
    assert key in caplog.records[0].getMessage()


def test_published_messages_are_stamped_and_counted_by_key() -> None:
    mailbox = Mailbox()
    mailbox.handover(1.5)
    mailbox.publish(KEYS.drive("a"), m.Drive(twist=Twist(0.0, 0.0)))
    mailbox.publish(KEYS.drive("b"), m.Drive(twist=Twist(0.0, 0.0)))
    mailbox.publish(KEYS.drive("a"), m.Drive(twist=Twist(0.0, 0.0)))
    out = [o.message for o in mailbox.collect()]
    assert [(o.key[-7:], o.stamp, o.sequence) for o in out] == [
        ("a/drive", 1.5, 0),
        ("b/drive", 1.5, 0),
        ("a/drive", 1.5, 1),
    ]
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
        key = inlet.topic.key
        inlet.offer_header(header(encode(Received(key, 1.0, number, _call(number).body, sender)), key), origin)
    inlet.handover()
    return [message.body.number for message in inlet.take()]


def test_an_event_that_comes_twice_is_handed_over_once() -> None:
    """However it came first, and also if the process that repeats it is asked for it besides."""
    inlet = Inlet(KEYS.referee_event)
    live, repeated, asked = ((origin, "coordinator/referee/1") for origin in Origin)
    assert _heard(inlet, (0, *live), (1, *live), (1, *asked), (1, *live), (1, *repeated), (2, *asked)) == [0, 1, 2]
    assert _heard(inlet, (2, *live), (3, *repeated), (3, *asked), (4, *live)) == [3, 4]


def test_a_sender_that_begins_anew_is_heard_and_old_events_of_a_stranger_are_not() -> None:
    inlet = Inlet(KEYS.referee_event)
    old, new = "coordinator/referee/1", "coordinator/referee/2"
    assert _heard(inlet, (7, Origin.LIVE, old), (0, Origin.LIVE, new), (1, Origin.REPEATED, new)) == [7, 0, 1]
    assert _heard(inlet, (5, Origin.ASKED, "coordinator/other/1")) == []
    assert _heard(inlet, (6, Origin.REPEATED, "coordinator/other/1")) == [6], "it may have been published just now"


def test_what_has_an_alarm_counts_whatever_the_number_of_its_message() -> None:
    """A simple program that engages the emergency stop may number all of its messages alike."""
    sounded: list[int] = []
    inlet = Inlet(KEYS.estop, lambda message: sounded.append(message.sequence))
    key = KEYS.estop.key
    head = header(encode(Received(key, 0.0, 3, m.Estop(by="button"), "official/button/1")), key)
    for origin in (Origin.LIVE, Origin.LIVE, Origin.REPEATED, Origin.ASKED):
        inlet.offer_header(head, origin)
    assert sounded == [], "the executor has sounded it when it arrived"
    inlet.sound(head)
    assert sounded == [3]
    inlet.handover()
    assert len(inlet.take()) == 2


def test_the_numbers_of_invented_senders_fill_no_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.bus.mailbox.SENDERS_LIMIT", 3)
    numbers, key = Numbers(), KEYS.referee_event.key
    for sender in range(100):
        head = header(encode(Received(key, 1.0, 1, _call(1).body, f"coordinator/{sender}/1")), key)
        assert numbers.is_new(head, Origin.LIVE)
    assert len(numbers._newest) <= 3


def test_keys_that_somebody_invents_fill_no_memory_and_cost_others_nothing() -> None:
    inlet = Inlet(KEYS.drive())
    assert inlet.admits(KEYS.drive("a").key)
    invented = [KEYS.drive(f"x{number}").key for number in range(5 * KEYS_LIMIT)]
    assert sum(map(inlet.admits, invented)) == KEYS_LIMIT - 1
    assert inlet.admits(KEYS.drive("a").key)
    assert inlet.dropped == len(invented) - KEYS_LIMIT + 1


def test_where_the_keys_are_known_no_other_counts() -> None:
    ann = KEYS.report("ann").key
    inlet = Mailbox().subscribe(KEYS.report(), only=[ann])
    assert not inlet.admits(KEYS.report("bob").key)
    assert inlet.admits(ann)
    assert inlet.dropped == 0


def test_messages_of_one_instant_are_in_the_order_of_key_sender_and_number() -> None:
    key = KEYS.referee_event.key
    senders = ["player/ann", "player/ann-b", "player/bob"]
    for end in ("", "/3f60c1d2"):
        inlet = Inlet(KEYS.referee_event)
        wanted = [(sender + end, number) for sender in senders for number in (0, 1)]
        for sender, number in reversed(wanted):
            inlet.offer(Received(key, 1.0, number, _call(number).body, sender))
        inlet.handover()
        assert [(message.sender, message.sequence) for message in inlet.take()] == wanted
