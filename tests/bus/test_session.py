"""The bus over a real router, between sessions of their own."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
import zenoh

from vrg.bus import messages as m
from vrg.bus.codec import Received, decode, encode
from vrg.bus.configuration import MAX_MESSAGE_SIZE, client_settings
from vrg.bus.flood import MAX_MESSAGE_RATE
from vrg.bus.link import EVENTS_KEPT
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick, due_index
from vrg.bus.process import claim, run_node, run_world
from vrg.bus.session import Session, configuration, open_router, open_session
from vrg.bus.topics import Keys, Qos, Topic
from vrg.errors import BusError, DuplicateNodeError
from vrg.types import STILL, Twist

KEYS = Keys("m")
PATIENCE = 60.0


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
    return m.Call(number=number, rule="r", text="", players=(), poses=(), clock=0.0)


class Calls:
    """Calls that one session publishes and another one hears. The mailboxes must be attached to `other`."""

    def __init__(self, one: Session, other: Session) -> None:
        self._one, self._other = one, other
        self.sender, self.receiver = Mailbox("coordinator/referee"), Mailbox()
        self._inlet = self.receiver.subscribe(KEYS.referee_event)
        self.numbers: list[int] = []

    def send(self, number: int) -> None:
        self.sender.publish(KEYS.referee_event, call(number))
        self._one.send(self.sender.collect())

    def heard(self, number: int) -> bool:
        receive(self._other, self.receiver)
        self.numbers.extend(c.body.number for c in self._inlet.take())
        return number in self.numbers


def test_a_message_that_is_too_long_is_dropped_and_the_link_stays(endpoint: str) -> None:
    heard: list[int] = []
    with open_session(endpoint) as one, open_session(endpoint) as other:
        other.watch_raw("vrg/m/**", lambda _, payload: heard.append(len(payload)), history=False)
        assert one.wait_for_listener("vrg/m/x", Qos.EVENT, PATIENCE)
        raw = one._link.raw
        for length in (1, MAX_MESSAGE_SIZE + 1, MAX_MESSAGE_SIZE // 2, 2):
            raw.put("vrg/m/x", bytes(length), congestion_control=zenoh.CongestionControl.BLOCK)
        wait(lambda: 2 in heard, "the last message")
    assert heard == [1, MAX_MESSAGE_SIZE // 2, 2]


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
        calls = Calls(one, other)
        other.attach(calls.receiver)
        assert one.wait_for_listener(KEYS.referee_event.key, KEYS.referee_event.qos, PATIENCE)
        calls.send(1)
        wait(lambda: calls.heard(1), "the first")
        router.close()
        wait(lambda: not one.connected and not other.connected, "the router to be missed")
        calls.send(2)
        calls.send(3)
        stack.enter_context(open_router(endpoint))
        wait(lambda: calls.heard(3), "what was missed")
        assert calls.numbers == [1, 2, 3]


@pytest.fixture
def put(endpoint: str) -> Iterator[Callable[[str, bytes], None]]:
    """Publishes bytes on a key, as zenoh does that has mixed up the keys."""
    raw = zenoh.open(configuration(client_settings(endpoint)))
    yield raw.put
    raw.close()  # type: ignore[no-untyped-call]


def drive(robot: str, v: float, sequence: int = 0, sender: str = "player/x/1") -> bytes:
    return encode(Received(KEYS.drive(robot).key, 1.0, sequence, m.Drive(twist=Twist(v, 0.0)), sender))


def test_a_message_under_the_key_of_another_robot_is_refused_and_counted(
    endpoint: str, put: Callable[[str, bytes], None], caplog: pytest.LogCaptureFixture
) -> None:
    ann, bob = KEYS.drive("ann").key, KEYS.drive("bob").key
    with open_session(endpoint) as session:
        receiver, raw = Mailbox(), []
        exact, wide = receiver.subscribe(KEYS.drive("bob")), receiver.subscribe(KEYS.drive())
        session.attach(receiver)
        session.watch_raw(KEYS.drive().key, lambda key, payload: raw.append((key, payload)))

        def heard(v: float) -> bool:
            receive(session, receiver)
            return ann in wide.by_key and wide.by_key[ann].body.twist.v == v

        wait(lambda: (put(ann, drive("ann", 0.5)), heard(0.5))[1], "the first")
        put(bob, drive("bob", 0.1))
        put(bob, drive("ann", 0.9, 1))
        put(bob, drive("ann", 0.8, 2))
        put(ann, drive("ann", 0.6, 3))
        wait(lambda: heard(0.6), "the last")
        wait(lambda: session.refused == {bob: 2 * 3}, "each of the three that listen to refuse both")
        wait(lambda: (receive(session, receiver), bool(exact.by_key))[1], "what was meant for the robot")
        assert [r.body.twist.v for r in exact.by_key.values()] == [0.1]
        assert {key: r.body.twist.v for key, r in wide.by_key.items()} == {ann: 0.6, bob: 0.1}

        def drives() -> set[tuple[str, float]]:
            return {(key, decode(payload, m.Drive, key).body.twist.v) for key, payload in raw}

        wait(lambda: drives() == {(ann, 0.5), (bob, 0.1), (ann, 0.6)}, "the same, undecoded")
    told = [record.message for record in caplog.records if "refused" in record.message]
    assert told == [f"refused a message: {bob}: expected a message for this key, got one of player/x/1 for {ann}"]


def test_with_seats_a_sender_is_heard_on_its_own_keys_only(endpoint: str, put: Callable[[str, bytes], None]) -> None:
    raw = zenoh.open(configuration(client_settings(endpoint)))
    session = Session(raw, lambda: raw, seats=True)
    with contextlib.closing(session):
        receiver = Mailbox()
        inlet = receiver.subscribe(KEYS.drive())
        session.attach(receiver)
        key = KEYS.drive("ann").key

        def heard() -> bool:
            put(key, drive("ann", 0.5, sender="player/ann/1"))
            put(key, drive("ann", 0.9, sender="player/bob/1"))
            receive(session, receiver)
            senders.update(r.sender for r in inlet.take())
            return session.refused[key] > 3 and bool(senders)

        senders: set[str] = set()
        wait(heard, "the player's own, and some of the other's")
        assert senders == {"player/ann/1"}


class Cuttable:
    """A way to a router that can be cut while both ends go on: it passes bytes between two ports."""

    def __init__(self, endpoint: str) -> None:
        self._to = ("127.0.0.1", int(endpoint.rpartition(":")[2]))
        self._server = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._server.getsockname()[1]}"
        self._ends: list[socket.socket] = []
        self.open = True
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                end, _ = self._server.accept()
                if not self.open:
                    end.close()
                    continue
                other = socket.create_connection(self._to)
                self._ends += [end, other]
                for pair in ((end, other), (other, end)):
                    threading.Thread(target=self._pass, args=pair, daemon=True).start()

    @staticmethod
    def _pass(source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                target.sendall(data)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def cut(self) -> None:
        self.open = False
        for end in self._ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def mend(self) -> None:
        self.open = True

    def close(self) -> None:
        self._server.close()
        self.cut()


@pytest.fixture
def way(endpoint: str) -> Iterator[Cuttable]:
    with contextlib.closing(Cuttable(endpoint)) as found:
        yield found


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The ids of the sessions of zenoh's that are opened from now on."""
    found: list[str] = []
    real = zenoh.open

    def opens(settings: zenoh.Config) -> zenoh.Session:
        raw = real(settings)
        found.append(str(raw.zid()))
        return raw

    monkeypatch.setattr(zenoh, "open", opens)
    return found


def test_after_a_lost_link_there_is_a_new_session_that_has_everything_of_the_old_one(
    endpoint: str, way: Cuttable, opened: list[str]
) -> None:
    """The receiver's link is cut: what it has missed comes later, once; what is from before it was there does not."""
    topic = KEYS.referee_event
    with open_session(endpoint) as one, open_session(endpoint) as stranger, open_session(way.endpoint) as other:
        calls, unheard = Calls(one, other), Mailbox("coordinator/other")
        sender, receiver = calls.sender, calls.receiver
        limits = receiver.subscribe(KEYS.speed_limit())
        unheard.publish(topic, call(99))
        with open_session(endpoint) as third:
            witness = Mailbox()
            early = witness.subscribe(topic)
            third.attach(witness)
            assert stranger.wait_for_listener(topic.key, topic.qos, PATIENCE)
            stranger.send(unheard.collect())
            wait(lambda: (receive(third, witness), bool(early.take()))[1], "the router to have passed it on")
        other.attach(receiver)
        other.declare_alive(KEYS.alive("player", "ann", "1"))
        raw: list[str] = []
        other.watch_raw(KEYS.drive().key, lambda key, _payload: raw.append(key))
        take = other.collect_raw(KEYS.drive().key, 100)
        assert one.wait_for_listener(topic.key, topic.qos, PATIENCE)
        calls.send(1)
        wait(lambda: calls.heard(1), "the first")
        calls.send(2)
        way.cut()
        wait(lambda: not other.connected, "the link to be missed")
        calls.send(3)
        sender.publish(KEYS.speed_limit("ann"), m.SpeedLimit(v_max=0.5))
        calls.send(4)
        way.mend()
        wait(lambda: other.connected, "the link to be back")
        calls.send(5)
        wait(lambda: calls.heard(5), "what was missed, and what came then")
        assert len(opened) == len(set(opened)) == 5, "each with an id of its own"
        assert KEYS.alive("player", "ann", "1") in one.alive(KEYS.alive())
        wait(lambda: (receive(other, receiver), limits.latest is not None)[1], "the state")

        def drives() -> bool:
            sender.publish(KEYS.drive("ann"), m.Drive(twist=STILL))
            one.send(sender.collect())
            return bool(raw) and bool(take())

        wait(drives, "what is only looked at")
        calls.send(6)
        wait(lambda: calls.heard(6), "the next")
        assert calls.numbers == [1, 2, 3, 4, 5, 6]


def test_what_was_published_while_the_link_was_lost_arrives_once(endpoint: str, way: Cuttable) -> None:
    """The sender's link is cut."""
    topic = KEYS.referee_event
    with open_session(way.endpoint) as one, open_session(endpoint) as other:
        calls = Calls(one, other)
        sender, receiver = calls.sender, calls.receiver
        limits = receiver.subscribe(KEYS.speed_limit())
        other.attach(receiver)

        def send(number: int) -> None:
            sender.publish(KEYS.speed_limit("ann"), m.SpeedLimit(v_max=0.1 * number))
            calls.send(number)

        assert one.wait_for_listener(topic.key, topic.qos, PATIENCE)
        send(1)
        send(2)
        wait(lambda: calls.heard(2), "what was sent before")
        way.cut()
        wait(lambda: not one.connected, "the link to be missed")
        send(3)
        send(4)
        way.mend()
        wait(lambda: calls.heard(4), "what was sent meanwhile")
        send(5)
        wait(lambda: calls.heard(5), "the next")
        assert calls.numbers == [1, 2, 3, 4, 5]

        def limited() -> bool:
            receive(other, receiver)
            return limits.latest is not None and limits.latest.body.v_max == 0.5

        wait(limited, "the newest state")
        with open_session(endpoint) as late:
            joined = Mailbox()
            inlet = joined.subscribe(KEYS.speed_limit())
            late.attach(joined)
            wait(lambda: (receive(late, joined), inlet.latest is not None)[1], "the state, for a late joiner")


def test_events_come_once_and_in_order_however_often_both_links_are_lost(endpoint: str) -> None:
    """The node takes in what has come at once, late, and while it is being asked what was missed."""
    topic = KEYS.referee_event
    with (
        contextlib.closing(Cuttable(endpoint)) as out,
        contextlib.closing(Cuttable(endpoint)) as back,
        open_session(out.endpoint) as one,
        open_session(back.endpoint) as other,
    ):
        sender, receiver = Mailbox("coordinator/referee"), Mailbox()
        calls = receiver.subscribe(topic)
        other.attach(receiver)
        assert one.wait_for_listener(topic.key, topic.qos, PATIENCE)
        numbers: list[int] = []
        sent = turns = 0
        most = 1000

        def go_on() -> bool:
            nonlocal sent, turns
            turns += 1
            if sent < most:
                sent += 1
                sender.publish(topic, call(sent))
                one.send(sender.collect())
            if turns % 3 == 0:
                receive(other, receiver)
                numbers.extend(c.body.number for c in calls.take())
            return bool(numbers)

        wait(go_on, "the first")
        for ways in ([back], [out], [out, back], [back], [out, back]):
            most = sent + EVENTS_KEPT // 2  # however long it takes, not more than is kept
            for way in ways:
                way.cut()
            wait(lambda: go_on() and not (one.connected and other.connected), "the links to be missed")
            for way in ways:
                way.mend()
            wait(lambda: go_on() and one.connected and other.connected, "the links")
            # Publishers keep EVENTS_KEPT, so no more may be sent before it has been asked for what was missed.
            missed, most = sent, most + EVENTS_KEPT // 4
            wait(lambda missed=missed: go_on() and numbers[-1] >= missed, "what was missed")  # type: ignore[misc]
            most, until = 10_000, sent + 60
            wait(lambda until=until: go_on() and sent >= until, "more")  # type: ignore[misc]
        last = sent

        def all_here() -> bool:
            receive(other, receiver)
            numbers.extend(c.body.number for c in calls.take())
            return numbers[-1] == last

        wait(all_here, "the last")
        assert numbers == list(range(numbers[0], last + 1))


def test_a_release_that_could_not_be_given_at_once_is_never_given(endpoint: str, way: Cuttable) -> None:
    """Somebody may have engaged the emergency stop again meanwhile."""
    with open_session(way.endpoint) as one, open_session(endpoint) as other:
        sender, receiver = Mailbox("official/ann"), Mailbox()
        releases, stops = receiver.subscribe(KEYS.estop_release), receiver.subscribe(KEYS.estop)
        other.attach(receiver)

        def give(topic: Topic[m.Message], order: m.Message) -> None:
            sender.publish(topic, order)
            one.send(sender.collect())

        def given() -> tuple[int, int]:
            receive(other, receiver)
            counts[0] += len(releases.take())
            counts[1] += len(stops.take())
            return counts[0], counts[1]

        counts = [0, 0]
        assert one.wait_for_listener(KEYS.estop_release.key, Qos.EVENT, PATIENCE)
        give(KEYS.estop_release, m.EstopRelease(by="ann"))  # type: ignore[arg-type]
        wait(lambda: given() == (1, 0), "the first")
        way.cut()
        wait(lambda: not one.connected, "the link to be missed")
        give(KEYS.estop_release, m.EstopRelease(by="ann"))  # type: ignore[arg-type]
        give(KEYS.estop, m.Estop(by="ann"))  # type: ignore[arg-type]
        way.mend()
        wait(lambda: given()[1] == 1, "the emergency stop, which counts whenever it comes")
        assert counts == [1, 1]
        give(KEYS.estop_release, m.EstopRelease(by="ann"))  # type: ignore[arg-type]
        wait(lambda: given() == (2, 1), "the next")


def test_a_mailbox_can_be_attached_while_a_link_is_lost(endpoint: str, way: Cuttable) -> None:
    with open_session(way.endpoint) as session, open_session(endpoint) as other:
        way.cut()
        wait(lambda: not session.connected, "the link to be missed")
        mailbox, sender = Mailbox(), Mailbox("coordinator/referee")
        calls = mailbox.subscribe(KEYS.referee_event)
        session.attach(mailbox)
        way.mend()
        assert other.wait_for_listener(KEYS.referee_event.key, Qos.EVENT, PATIENCE)
        sender.publish(KEYS.referee_event, call(1))
        other.send(sender.collect())
        wait(lambda: (receive(session, mailbox), bool(calls.take()))[1], "a call")


def test_a_listener_is_waited_for_while_the_link_is_lost(endpoint: str, way: Cuttable) -> None:
    with open_session(way.endpoint) as session, open_session(endpoint) as other:
        mailbox = Mailbox()
        mailbox.subscribe(KEYS.estop)
        other.attach(mailbox)
        way.cut()
        wait(lambda: not session.connected, "the link to be missed")
        threading.Timer(0.3, way.mend).start()
        assert session.wait_for_listener(KEYS.estop.key, Qos.EVENT, PATIENCE)


def test_what_goes_wrong_with_a_link_is_raised_where_messages_are_received(
    endpoint: str, way: Cuttable, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(_settings: object) -> None:
        raise OSError("the keys are gone")

    with open_session(way.endpoint) as session:
        monkeypatch.setattr(zenoh, "open", fails)
        way.cut()

        def raised() -> bool:
            try:
                session.receive()
            except OSError:
                return True
            return False

        wait(raised, "the error")


def test_nobody_at_the_endpoint_is_told_with_what_to_do() -> None:
    with (
        pytest.raises(BusError, match="start one with `vrg node"),
        open_session("tcp/127.0.0.1:1", patience=0.3),
    ):
        pass


def test_an_endpoint_that_is_taken_is_told(endpoint: str) -> None:
    with pytest.raises(BusError, match="is another one running there"), open_router(endpoint):
        pass


def test_waiting_for_a_listener_ends(endpoint: str) -> None:
    with open_session(endpoint) as one:
        assert not one.wait_for_listener(KEYS.estop.key, Qos.EVENT, 0.1)


def test_of_two_nodes_of_one_name_the_second_is_refused(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.bus.process.TAKEOVER_TIMEOUT", 0.3)
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


def test_of_a_flood_the_newest_state_counts_and_events_are_dropped(endpoint: str) -> None:
    """The clock of a world that is a hundred times as fast as real time comes 5,000 times a second."""
    with open_session(endpoint) as one, open_session(endpoint) as other:
        sender, receiver = Mailbox("world/world"), Mailbox()
        clock, calls = receiver.subscribe(KEYS.clock), receiver.subscribe(KEYS.referee_event)
        other.attach(receiver)
        for topic in (KEYS.clock, KEYS.referee_event):
            assert one.wait_for_listener(topic.key, topic.qos, PATIENCE)
        number = 3 * MAX_MESSAGE_RATE
        for tick in range(number):
            sender.publish(KEYS.clock, m.Clock(time=tick * 0.02, tick=tick, epoch=0, rate=100.0, estop=False))
            sender.publish(KEYS.referee_event, call(tick))
        sender.publish(KEYS.clock, m.Clock(time=1e6, tick=10**7, epoch=0, rate=100.0, estop=False))
        one.send(sender.collect())
        heard: list[int] = []

        def newest() -> bool:
            receive(other, receiver)
            heard.extend(c.body.number for c in calls.take())
            return clock.latest is not None and clock.latest.body.tick == 10**7

        wait(newest, "the newest clock")
        wait(lambda: newest() and bool(other.dropped), "events to be dropped")
        assert heard == sorted(heard)
        assert len(heard) < number
        assert not other.refused


def test_an_alarm_that_fails_is_raised_by_the_next_look(endpoint: str) -> None:
    def fail(_: object) -> None:
        raise ValueError("broken")

    with open_session(endpoint) as one, open_session(endpoint) as other:
        sender, receiver = Mailbox("official/ann"), Mailbox()
        receiver.subscribe(KEYS.estop, alarm=fail)
        other.attach(receiver)
        assert one.wait_for_listener(KEYS.estop.key, KEYS.estop.qos, PATIENCE)
        sender.publish(KEYS.estop, m.Estop(by="ann"))
        one.send(sender.collect())

        def failed() -> bool:
            with contextlib.suppress(ValueError):
                other.receive()
                return False
            return True

        wait(failed, "the failure")
