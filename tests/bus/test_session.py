"""The bus over a real router, between sessions of their own."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest

from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick, due_index
from vrg.bus.process import claim, run_node, run_world
from vrg.bus.session import Session, open_router, open_session
from vrg.bus.topics import Keys, Qos
from vrg.errors import BusError, DuplicateNodeError
from vrg.types import STILL, Twist

KEYS = Keys("m")
PATIENCE = 10.0


@pytest.fixture
def endpoint() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        found = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with open_router(found):
        yield found


def wait(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"waited {PATIENCE} s in vain for {what}"
        time.sleep(0.005)


def receive(session: Session, mailbox: Mailbox) -> None:
    session.receive()
    mailbox.handover(0.0)


def call(number: int) -> m.Call:
    return m.Call(number=number, rule="r", text="", players=[], poses=[], clock=0.0)


def test_a_message_goes_from_one_session_to_another(endpoint: str) -> None:
    with open_session(endpoint) as one, open_session(endpoint) as other:
        sender, receiver = Mailbox(), Mailbox()
        inlet = receiver.subscribe(KEYS.drive())
        other.attach(receiver)
        topic = KEYS.drive("a")
        assert one.wait_for_listener(topic.key, topic.qos, PATIENCE)
        sender.handover(2.5)
        sender.publish(topic, m.Drive(twist=Twist(1.0, 2.0)))
        one.send(sender.collect())

        def arrived() -> bool:
            receive(other, receiver)
            return inlet.latest is not None

        wait(arrived, "the message")
        assert inlet.latest is not None
        assert (inlet.latest.stamp, inlet.latest.body.twist.w) == (2.5, 2.0)


def test_a_late_joiner_is_given_the_state_at_once(endpoint: str) -> None:
    with open_session(endpoint) as one:
        sender = Mailbox()
        for v_max in (0.3, 0.5):
            sender.publish(KEYS.speed_limit("a"), m.SpeedLimit(v_max=v_max))
        one.send(sender.collect())
        with open_session(endpoint) as other:
            receiver = Mailbox()
            inlet = receiver.subscribe(KEYS.speed_limit())
            other.attach(receiver)
            wait(lambda: (receive(other, receiver), inlet.latest is not None)[1], "the state of before")
            assert inlet.latest is not None
            assert inlet.latest.body.v_max == 0.5


def test_events_arrive_all_and_in_order(endpoint: str) -> None:
    with open_session(endpoint) as one, open_session(endpoint) as other:
        sender, receiver = Mailbox(), Mailbox()
        inlet = receiver.subscribe(KEYS.referee_event)
        other.attach(receiver)
        topic = KEYS.referee_event
        assert one.wait_for_listener(topic.key, topic.qos, PATIENCE)
        for number in range(500):
            sender.publish(topic, call(number))
        one.send(sender.collect())
        got: list[int] = []

        def all_here() -> bool:
            receive(other, receiver)
            got.extend(r.body.number for r in inlet.take())
            return len(got) >= 500

        wait(all_here, "500 events")
        assert got == list(range(500))


def test_events_that_were_missed_while_the_router_was_away_come_later() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with contextlib.ExitStack() as stack:
        router = contextlib.ExitStack()
        router.enter_context(open_router(endpoint))
        one, other = (stack.enter_context(open_session(endpoint)) for _ in range(2))
        sender, receiver = Mailbox(), Mailbox()
        inlet = receiver.subscribe(KEYS.referee_event)
        other.attach(receiver)
        assert one.wait_for_listener(KEYS.referee_event.key, KEYS.referee_event.qos, PATIENCE)
        numbers: list[int] = []

        def send(number: int) -> None:
            sender.publish(KEYS.referee_event, call(number))
            one.send(sender.collect())

        def heard(number: int) -> bool:
            receive(other, receiver)
            numbers.extend(c.body.number for c in inlet.take())
            return number in numbers

        send(1)
        wait(lambda: heard(1), "the first")
        router.close()
        wait(lambda: not one.connected and not other.connected, "the router to be missed")
        send(2)
        send(3)
        stack.enter_context(open_router(endpoint))
        wait(lambda: heard(3), "what was missed")
        assert numbers == [1, 2, 3]


def test_nobody_at_the_endpoint_is_told_with_what_to_do() -> None:
    with pytest.raises(BusError, match="start one with `vrg router`"), open_session("tcp/127.0.0.1:1", patience=0.3):
        pass


def test_an_endpoint_that_is_taken_is_told(endpoint: str) -> None:
    with pytest.raises(BusError, match="is another one running there"), open_router(endpoint):
        pass


def test_waiting_for_a_listener_ends(endpoint: str) -> None:
    with open_session(endpoint) as one:
        assert not one.wait_for_listener(KEYS.estop.key, Qos.EVENT, 0.1)


def test_of_two_nodes_of_one_name_the_second_is_refused(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.bus.process.TAKEOVER_PATIENCE", 0.3)
    with open_session(endpoint) as one, open_session(endpoint) as other:
        claim(one, KEYS, "coordinator", "referee")
        wait(lambda: bool(other.alive(KEYS.alive("coordinator", "referee"))), "the token of the first")
        with pytest.raises(DuplicateNodeError, match="already has a coordinator named 'referee'"):
            claim(other, KEYS, "coordinator", "referee")
        claim(other, KEYS, "player", "referee")


def test_a_node_that_left_can_be_replaced(endpoint: str) -> None:
    with open_session(endpoint) as other:
        with open_session(endpoint) as one:
            claim(one, KEYS, "world", "world")
        claim(other, KEYS, "world", "world")


def test_closing_twice_is_harmless(endpoint: str) -> None:
    with open_session(endpoint) as one:
        one.close()


class Clockwork(Node):
    """A world that only tells the time."""

    kind = "world"

    def __init__(self) -> None:
        super().__init__("world", Mailbox(), 0.02)
        self.ticks = 0

    def tick(self, tick: Tick) -> None:
        clock = m.Clock(time=tick.time, tick=self.ticks, epoch=0, rate=1.0, estop=False)
        self.mailbox.publish(KEYS.clock, clock)
        self.ticks += 1


class Listener(Node):
    """Remembers its ticks; may fail."""

    kind = "player"

    def __init__(self, fails_at: float | None = None) -> None:
        super().__init__("a", Mailbox(), 0.1)
        self.seen: list[Tick] = []
        self.fails_at = fails_at

    def tick(self, tick: Tick) -> None:
        self.seen.append(tick)
        if self.fails_at is not None and tick.time >= self.fails_at:
            raise ZeroDivisionError

    def stop(self) -> None:
        self.mailbox.publish(KEYS.drive("a"), m.Drive(twist=STILL, armed=False))


@pytest.fixture
def world(endpoint: str) -> Iterator[threading.Event]:
    """A running clock; set the event to stop it."""
    stop = threading.Event()

    def run() -> None:
        with open_session(endpoint) as session:
            run_world(Clockwork(), session, KEYS, stop, first_tick=0, rate=5.0, after_tick=lambda _tick: None)

    thread = threading.Thread(target=run)
    thread.start()
    yield stop
    stop.set()
    thread.join(PATIENCE)
    assert not thread.is_alive()


def test_a_world_of_processes_cannot_run_as_fast_as_possible(endpoint: str) -> None:
    with open_session(endpoint) as session, pytest.raises(ValueError, match="above 0, got 0"):
        run_world(Clockwork(), session, KEYS, threading.Event(), first_tick=0, rate=0.0, after_tick=lambda _tick: None)


def test_a_node_ticks_by_the_match_clock_and_is_told_when_it_stops(endpoint: str, world: threading.Event) -> None:
    node, stop = Listener(), threading.Event()
    with open_session(endpoint) as session:
        thread = threading.Thread(target=run_node, args=(node, session, KEYS, stop))
        thread.start()
        wait(lambda: len(node.seen) > 10, "ten ticks")
        world.set()
        wait(lambda: not node.seen[-1].live, "a tick without a clock")
        stop.set()
        thread.join(PATIENCE)
    live = [t.time for t in node.seen if t.live]
    assert live == sorted(live)
    indices = [due_index(time, node.period) for time in live]
    assert all(b > a for a, b in pairwise(indices)), "once in each period"
    assert node.seen[-1].time == pytest.approx(live[-1], abs=0.1)


def test_an_exception_of_a_node_stops_its_robot_and_is_not_swallowed(endpoint: str, world: threading.Event) -> None:
    with open_session(endpoint) as session, open_session(endpoint) as watching:
        mailbox = Mailbox()
        drives = mailbox.subscribe(KEYS.drive())
        watching.attach(mailbox)
        with pytest.raises(ZeroDivisionError):
            run_node(Listener(fails_at=0.0), session, KEYS, threading.Event())
        wait(lambda: (receive(watching, mailbox), drives.latest is not None)[1], "the last command")
        assert drives.latest is not None
        assert not drives.latest.body.armed


def test_missed_ticks_are_counted(endpoint: str) -> None:
    node, stop = Listener(), threading.Event()
    with open_session(endpoint) as session, open_session(endpoint) as other:
        world = Mailbox()
        thread = threading.Thread(target=lambda: results.append(run_node(node, session, KEYS, stop)))
        results: list[object] = []
        thread.start()
        assert other.wait_for_listener(KEYS.clock.key, Qos.LATEST, PATIENCE)
        for tick in (0, 5, 35):
            before = len(node.seen)
            world.handover(tick * 0.02)
            world.publish(KEYS.clock, m.Clock(time=tick * 0.02, tick=tick, epoch=0, rate=1.0, estop=False))
            other.send(world.collect())
            wait(lambda before=before: len(node.seen) > before, "a tick")  # type: ignore[misc]
        stop.set()
        thread.join(PATIENCE)
    assert results[0].missed == 5  # type: ignore[attr-defined]
