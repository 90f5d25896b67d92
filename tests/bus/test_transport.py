"""The contract of a transport, for each of them."""

import threading
from collections.abc import Iterator

import pytest

from tests.bus.bench import KEYS, PATIENCE, Pair, call, free, wait
from vrg.bus import messages as m
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Message
from vrg.bus.node import Node, Tick
from vrg.bus.session import Session, open_router, open_session
from vrg.bus.transport import MemoryTransport, Transport, turn
from vrg.types import Twist

Transports = tuple[Transport, Transport]


@pytest.fixture(params=["memory", "strict memory", "sessions"])
def pair(request: pytest.FixtureRequest) -> Iterator[Transports]:
    """The transports of two nodes."""
    if request.param != "sessions":
        memory = MemoryTransport(strict=request.param == "strict memory")
        yield memory, memory
        return
    endpoint = free()
    with open_router(endpoint), open_session(endpoint) as one, open_session(endpoint) as other:
        yield one, other


def test_all_events_arrive_in_their_order(pair: Transports) -> None:
    table = Pair(*pair, KEYS.referee_event)
    table.ready()
    for first in range(0, 500, 100):
        table.call(*range(first, first + 100))
    table.until_called(499)
    assert table.numbers == list(range(500))


def test_a_message_is_what_was_sent_with_its_stamp_and_sender_and_the_executor_is_called(pair: Transports) -> None:
    table = Pair(*pair, KEYS.referee_event)
    arrived: list[Inlet[Message]] = []
    table.ready(on_arrival=arrived.append)
    table.sender.handover(2.5)
    table.call(7)
    table.until(lambda: table.inlets[0].latest is not None, "the call")
    got = table.inlets[0].latest
    assert got is not None
    assert (got.body, got.stamp, got.sequence, got.key) == (call(7), 2.5, 0, KEYS.referee_event.key)
    assert got.sender.startswith("coordinator/referee")
    wait(lambda: bool(arrived), "the executor to be called")
    assert arrived[0] is table.inlets[0]


def test_of_what_is_perishable_the_newest_of_each_key_arrives(pair: Transports) -> None:
    a, b = KEYS.drive("a"), KEYS.drive("b")
    table = Pair(*pair, KEYS.drive())
    table.ready(a, b)
    inlet = table.inlets[0]
    for v in (0.1, 0.2, 0.3):
        table.send((a, m.Drive(twist=Twist(v, 0.0))), (b, m.Drive(twist=Twist(-v, 0.0))))

    def speeds() -> dict[str, float]:
        return {key: r.body.twist.v for key, r in inlet.by_key.items() if isinstance(r.body, m.Drive)}

    table.until(lambda: speeds() == {a.key: 0.3, b.key: -0.3}, "the newest")


def test_only_the_keys_that_were_asked_for_are_heard(pair: Transports) -> None:
    a, b = KEYS.report("a"), KEYS.report("b")
    table = Pair(*pair)
    inlet = table.receiver.subscribe(KEYS.report(), only=[b.key])
    table.ready(a, b)
    table.send((a, m.Report(mode="a", armed=True)), (b, m.Report(mode="b", armed=True)))
    table.until(lambda: inlet.by_key, "what was asked for")
    assert set(inlet.by_key) == {b.key}
    inlet.only([a.key])
    table.send((a, m.Report(mode="c", armed=True)), (b, m.Report(mode="d", armed=True)))
    table.until(lambda: a.key in inlet.by_key, "what is asked for now")
    assert [(r.key, r.body.mode) for r in inlet.by_key.values()] == [(b.key, "b"), (a.key, "c")]


def test_who_publishes_what_it_subscribes_to_hears_itself(pair: Transports) -> None:
    table = Pair(pair[0], pair[0])
    table.receiver = table.sender
    table.inlets = [table.sender.subscribe(KEYS.referee_event)]
    table.other.attach(table.sender)
    table.call(1)
    table.until_called(1)


def test_an_alarm_sounds_without_a_tick_and_the_message_is_handed_over_at_the_next_one(pair: Transports) -> None:
    table = Pair(*pair)
    sounded = threading.Event()
    inlet = table.receiver.subscribe(KEYS.estop, alarm=lambda _: sounded.set())
    table.ready(KEYS.estop)
    table.send((KEYS.estop, m.Estop(by="ann")))
    assert sounded.wait(PATIENCE)
    assert inlet.take() == []
    table.until(inlet.take, "the message")


@pytest.mark.parametrize("taken", [False, True], ids=["the newest is asked for", "somebody takes each"])
def test_what_is_deferred_arrives_like_what_is_published(pair: Transports, taken: bool) -> None:
    a, b = KEYS.drive("a"), KEYS.drive("b")
    table = Pair(*pair, name="player/a")
    inlet = table.receiver.subscribe(a, sampled=True)
    every = table.receiver.subscribe(KEYS.drive() if taken else KEYS.report())
    table.sender.deferring = [a, b]
    table.one.attach(table.sender)
    table.ready(a)
    made: list[float] = []

    def deferred(time: float) -> None:
        def make() -> list[m.Drive]:
            made.append(time)
            return [m.Drive(twist=Twist(time, 0.0)), m.Drive(twist=Twist(-time, 0.0))]

        table.sender.handover(time)
        table.sender.defer([a, b], make)
        table.one.send(table.sender.collect())

    for time in (1.0, 2.0, 3.0):
        deferred(time)
        if taken:
            table.until(lambda time=time: every.by_key and every.by_key[a.key].stamp == time, "each message")  # type: ignore[misc]
    table.until(lambda: (newest := inlet.latest) is not None and newest.stamp == 3.0, "the newest")
    newest = inlet.latest
    assert newest is not None
    assert (newest.key, newest.body, newest.sender[:8]) == (a.key, m.Drive(twist=Twist(3.0, 0.0)), "player/a")
    assert inlet.latest is newest, "it is made once"
    if isinstance(table.one, MemoryTransport) and not table.one.strict and not taken:
        assert made == [1.0, 3.0], (
            "the first is published, as nobody was asked yet who hears it; the second was not read"
        )
    else:
        assert set(made) == {1.0, 2.0, 3.0}


def test_a_strict_transport_refuses_what_depends_on_when_it_is_made() -> None:
    transport, sender, asker = MemoryTransport(strict=True), Mailbox("world/world"), Mailbox("player/a")
    topic, speed = KEYS.drive("a"), [0.0]
    asker.subscribe(topic, sampled=True)
    sender.deferring = [topic]
    transport.attach(sender)
    transport.attach(asker)

    def send() -> None:
        sender.defer([topic], lambda: [m.Drive(twist=Twist(speed[0], 0.0))])
        transport.send(sender.collect())

    send()
    send()
    send()
    speed[0] = 1.0
    with pytest.raises(TypeError, match=r"drive: expected the same message whenever it is made, got .*0\.0.*1\.0"):
        send()


class _Counter(Node):
    """Publishes the number after the greatest that it has heard."""

    kind = "coordinator"

    def __init__(self, name: str) -> None:
        super().__init__(name, Mailbox(), 0.1)
        self.calls = self.mailbox.subscribe(KEYS.referee_event)
        self.heard = 0
        self.began = 0

    def begin(self, tick: Tick) -> None:
        self.began += 1

    def tick(self, tick: Tick) -> None:
        assert self.began, "it begins before it is ticked"
        self.heard = max([self.heard, *(c.body.number for c in self.calls.take())])
        self.mailbox.publish(KEYS.referee_event, call(self.heard + 1))


def test_a_node_is_given_in_a_turn_what_others_have_published_in_earlier_ones(pair: Transports) -> None:
    nodes = [_Counter("a"), _Counter("b")]
    for node, transport in zip(nodes, pair, strict=True):
        transport.attach(node.mailbox)
    for transport in pair:
        if isinstance(transport, Session):
            assert transport.wait_for_listener(KEYS.referee_event.key, KEYS.referee_event.qos, PATIENCE)
    turns: list[Tick] = []

    def one_more() -> bool:
        turns.append(Tick(0.1 * (1 + len(turns))))
        for node, transport in zip(nodes, pair, strict=True):
            transport.receive()
            turn([node], turns[-1], transport)
        return nodes[1].heard >= 10

    wait(one_more, "the tenth call")
    assert len(turns) >= 5, "in each turn a node adds one at the most"


def test_in_one_turn_no_node_hears_another_one(pair: Transports) -> None:
    transport, _ = pair
    nodes = [_Counter("a"), _Counter("b")]
    for node in nodes:
        transport.attach(node.mailbox)
    transport.receive()
    turn(nodes, Tick(0.1), transport)
    assert [node.heard for node in nodes] == [0, 0]


@pytest.mark.parametrize("where", ["begin", "tick"])
def test_what_a_failing_node_raises_names_it_and_nothing_of_its_tick_is_sent(
    where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(tick: Tick) -> None:
        node.mailbox.publish(KEYS.referee_event, call(1))
        raise ValueError("no")

    transport = MemoryTransport()
    node, other = _Counter("a"), _Counter("b")
    monkeypatch.setattr(node, where, fail)
    for each in (node, other):
        transport.attach(each.mailbox)
    with pytest.raises(ValueError, match="no") as caught:
        turn([node], Tick(1.5), transport)
    assert caught.value.__notes__ == ["raised by coordinator a at match time 1.50 s"]
    turn([other], Tick(1.6), transport)
    assert other.heard == 0
