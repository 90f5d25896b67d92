"""The contract of a transport, for each of them."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from vrg.bus import messages as m
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Message
from vrg.bus.node import Node, Tick
from vrg.bus.session import Session, open_router, open_session
from vrg.bus.topics import Keys, Topic
from vrg.bus.transport import MemoryTransport, OnArrival, Transport, turn
from vrg.types import Pose, Twist

KEYS = Keys("m")
PATIENCE = 60.0


@pytest.fixture(params=["memory", "strict memory", "sessions"])
def pair(request: pytest.FixtureRequest) -> Iterator[tuple[Transport, Transport]]:
    """The transports of two nodes."""
    if request.param != "sessions":
        memory = MemoryTransport(strict=request.param == "strict memory")
        yield memory, memory
        return
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with ExitStack() as stack:
        stack.enter_context(open_router(endpoint))
        yield stack.enter_context(open_session(endpoint)), stack.enter_context(open_session(endpoint))


def call(number: int) -> m.Call:
    return m.Call(number=number, rule="r", text="", players=("a",), poses=(Pose(1.0, 2.0, 0.5),), clock=0.5)


class Table:
    """One who publishes, and one who hears."""

    def __init__(self, pair: tuple[Transport, Transport], *topics: Topic[Message]) -> None:
        self.one, self.other = pair
        self.sender, self.receiver = Mailbox("coordinator/referee"), Mailbox()
        self.inlets = [self.receiver.subscribe(topic) for topic in topics]

    def ready(self, *topics: Topic[Message], on_arrival: OnArrival | None = None) -> None:
        """Attach the receiver, and wait until the sender's transport knows that somebody listens."""
        self.other.attach(self.receiver, on_arrival)
        for topic in topics:
            if isinstance(self.one, Session):
                assert self.one.wait_for_listener(topic.key, topic.qos, PATIENCE)

    def send(self, *messages: tuple[Topic[Message], Message]) -> None:
        for topic, body in messages:
            self.sender.publish(topic, body)
        self.one.send(self.sender.collect())

    def receive_until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while True:
            self.other.receive()
            self.receiver.handover(0.0)
            if condition():
                return
            assert time.monotonic() < deadline, f"waited {PATIENCE} s in vain"
            time.sleep(0.005)


def test_all_events_arrive_in_their_order(pair: tuple[Transport, Transport]) -> None:
    table = Table(pair, KEYS.referee_event)
    table.ready(KEYS.referee_event)
    got: list[int] = []

    def all_here() -> bool:
        got.extend(c.body.number for c in table.inlets[0].take())
        return len(got) >= 300

    for first in range(0, 300, 100):
        table.send(*((KEYS.referee_event, call(n)) for n in range(first, first + 100)))
    table.receive_until(all_here)
    assert got == list(range(300))


def test_a_message_is_what_was_sent_with_its_stamp_and_sender(pair: tuple[Transport, Transport]) -> None:
    table = Table(pair, KEYS.referee_event)
    table.ready(KEYS.referee_event)
    table.sender.handover(2.5)
    table.send((KEYS.referee_event, call(7)))
    table.receive_until(lambda: table.inlets[0].latest is not None)
    got = table.inlets[0].latest
    assert got is not None
    assert (got.body, got.stamp, got.sequence, got.key) == (call(7), 2.5, 0, KEYS.referee_event.key)
    assert got.sender.startswith("coordinator/referee")


def test_of_what_is_perishable_the_newest_of_each_key_arrives(pair: tuple[Transport, Transport]) -> None:
    a, b = KEYS.drive("a"), KEYS.drive("b")
    table = Table(pair, KEYS.drive())
    table.ready(a, b)
    inlet = table.inlets[0]
    for v in (0.1, 0.2, 0.3):
        table.send((a, m.Drive(twist=Twist(v, 0.0))), (b, m.Drive(twist=Twist(-v, 0.0))))

    def speeds() -> dict[str, float]:
        return {key: r.body.twist.v for key, r in inlet.by_key.items() if isinstance(r.body, m.Drive)}

    table.receive_until(lambda: speeds() == {a.key: 0.3, b.key: -0.3})


def test_only_the_keys_that_were_asked_for_are_heard(pair: tuple[Transport, Transport]) -> None:
    a, b = KEYS.report("a"), KEYS.report("b")
    table = Table(pair)
    inlet = table.receiver.subscribe(KEYS.report(), only=[b.key])
    table.ready(a, b)
    table.send((a, m.Report(mode="a", armed=True)), (b, m.Report(mode="b", armed=True)))
    table.receive_until(lambda: bool(inlet.by_key))
    assert set(inlet.by_key) == {b.key}
    inlet.only([a.key])
    table.send((a, m.Report(mode="c", armed=True)), (b, m.Report(mode="d", armed=True)))
    table.receive_until(lambda: a.key in inlet.by_key)
    assert [(r.key, r.body.mode) for r in inlet.by_key.values()] == [(b.key, "b"), (a.key, "c")]


def test_who_publishes_what_it_subscribes_to_hears_itself(pair: tuple[Transport, Transport]) -> None:
    one, _ = pair
    own = Mailbox("coordinator/referee")
    inlet = own.subscribe(KEYS.referee_event)
    one.attach(own)
    own.publish(KEYS.referee_event, call(1))
    table = Table((one, one))
    table.receiver = own
    one.send(own.collect())
    table.receive_until(lambda: inlet.latest is not None)


def test_the_executor_is_called_when_something_arrives(pair: tuple[Transport, Transport]) -> None:
    table = Table(pair, KEYS.referee_event)
    arrived: list[Inlet[Message]] = []
    table.ready(KEYS.referee_event, on_arrival=arrived.append)
    table.send((KEYS.referee_event, call(1)))
    table.receive_until(lambda: bool(arrived))
    assert arrived[0] is table.inlets[0]


def test_an_alarm_sounds_without_a_tick_and_the_message_is_handed_over_at_the_next_one(
    pair: tuple[Transport, Transport],
) -> None:
    table = Table(pair)
    sounded = threading.Event()
    inlet = table.receiver.subscribe(KEYS.estop, alarm=lambda _: sounded.set())
    table.ready(KEYS.estop)
    table.send((KEYS.estop, m.Estop(by="ann")))
    assert sounded.wait(PATIENCE)
    assert inlet.take() == []
    table.receive_until(lambda: bool(inlet.take()))


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


def test_a_node_is_given_in_a_turn_what_others_have_published_in_earlier_ones(
    pair: tuple[Transport, Transport],
) -> None:
    nodes = [_Counter("a"), _Counter("b")]
    for node, transport in zip(nodes, pair, strict=True):
        transport.attach(node.mailbox)
    for transport in pair:
        if isinstance(transport, Session):
            assert transport.wait_for_listener(KEYS.referee_event.key, KEYS.referee_event.qos, PATIENCE)
    deadline = time.monotonic() + PATIENCE
    turns = 0
    while nodes[1].heard < 10:
        assert time.monotonic() < deadline
        turns += 1
        for node, transport in zip(nodes, pair, strict=True):
            transport.receive()
            turn([node], Tick(0.1 * turns), transport)
    assert turns >= 5, "in each turn a node adds one at the most"


def test_in_one_turn_no_node_hears_another_one(pair: tuple[Transport, Transport]) -> None:
    transport, _ = pair
    nodes = [_Counter("a"), _Counter("b")]
    for node in nodes:
        transport.attach(node.mailbox)
    transport.receive()
    turn(nodes, Tick(0.1), transport)
    assert [node.heard for node in nodes] == [0, 0]


def test_what_a_failing_node_raises_names_it_and_nothing_of_its_tick_is_sent() -> None:
    class Failing(_Counter):
        def tick(self, tick: Tick) -> None:
            super().tick(tick)
            raise ValueError("no")

    transport = MemoryTransport()
    node, other = Failing("a"), _Counter("b")
    for each in (node, other):
        transport.attach(each.mailbox)
    with pytest.raises(ValueError, match="no") as caught:
        turn([node], Tick(1.5), transport)
    assert caught.value.__notes__ == ["raised by coordinator a at match time 1.50 s"]
    turn([other], Tick(1.6), transport)
    assert other.heard == 0


def test_what_a_node_raises_as_it_begins_names_it_too() -> None:
    class Failing(_Counter):
        def begin(self, tick: Tick) -> None:
            raise ValueError("no")

    with pytest.raises(ValueError, match="no") as caught:
        turn([Failing("a")], Tick(1.5), MemoryTransport())
    assert caught.value.__notes__ == ["raised by coordinator a at match time 1.50 s"]
