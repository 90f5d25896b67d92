"""The bus over a real router, between sessions of their own."""

import contextlib
import math
import socket
import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
import zenoh

from tests.bus.bench import KEYS, PATIENCE, Pair, call, free, wait
from vrg.bus import messages as m
from vrg.bus.codec import Received, decode, encode
from vrg.bus.configuration import MAX_MESSAGE_SIZE, client_settings
from vrg.bus.flood import MAX_MESSAGE_RATE
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick, due_index
from vrg.bus.process import claim, run_node, run_world
from vrg.bus.router_link import EVENTS_KEPT, _undeclare
from vrg.bus.session import Session, configuration, open_router, open_session
from vrg.bus.topics import Qos, Topic
from vrg.commands.official import Conversation
from vrg.errors import BusError, DuplicateNodeError
from vrg.types import STILL, Twist

CALLS, LIMITS, WATCHED = KEYS.referee_event, KEYS.speed_limit(), KEYS.poses


@pytest.fixture
def endpoint() -> Iterator[str]:
    found = free()
    with open_router(found):
        yield found


def limit(v_max: float) -> tuple[Topic[m.SpeedLimit], m.SpeedLimit]:
    return KEYS.speed_limit("ann"), m.SpeedLimit(v_max=v_max)


def limited(pair: Pair) -> float | None:
    """The newest limit; the second inlet is that of limits."""
    latest = pair.inlets[1].latest
    return None if latest is None else latest.body.v_max


def lose(*sessions: Session) -> None:
    wait(lambda: not any(session.connected for session in sessions), "the link to be missed")


@pytest.fixture
def sessions(endpoint: str) -> Iterator[tuple[Session, Session]]:
    with open_session(endpoint) as one, open_session(endpoint) as other:
        yield one, other


def test_a_message_that_is_too_long_is_dropped_and_the_link_stays(sessions: tuple[Session, Session]) -> None:
    heard: list[int] = []
    one, other = sessions
    other.watch_raw("vrg/m/**", lambda _, payload: heard.append(len(payload)), history=False)
    assert one.wait_for_listener("vrg/m/x", Qos.EVENT, PATIENCE)
    for length in (1, MAX_MESSAGE_SIZE + 1, MAX_MESSAGE_SIZE // 2, 2):
        one._link.raw.put("vrg/m/x", bytes(length), congestion_control=zenoh.CongestionControl.BLOCK)
    wait(lambda: 2 in heard, "the last message")
    assert heard == [1, MAX_MESSAGE_SIZE // 2, 2]


def test_a_late_joiner_is_given_the_state_at_once(sessions: tuple[Session, Session]) -> None:
    pair = Pair(*sessions, CALLS, LIMITS)
    pair.send(limit(0.3), limit(0.5))
    pair.other.attach(pair.receiver)
    pair.until(lambda: limited(pair), "the state of before")
    assert limited(pair) == 0.5


def test_events_that_were_missed_while_the_router_was_away_come_later() -> None:
    endpoint = free()
    with contextlib.ExitStack() as stack:
        router = contextlib.ExitStack()
        router.enter_context(open_router(endpoint))
        one, other = (stack.enter_context(open_session(endpoint)) for _ in range(2))
        pair = Pair(one, other, CALLS)
        pair.ready()
        pair.call(1)
        pair.until_called(1)
        router.close()
        lose(one, other)
        pair.call(2)
        pair.call(3)
        stack.enter_context(open_router(endpoint))
        pair.until_called(3)
        assert pair.numbers == [1, 2, 3]


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
            session.receive()
            receiver.handover(0.0)
            return ann in wide.by_key and wide.by_key[ann].body.twist.v == v

        wait(lambda: (put(ann, drive("ann", 0.5)), heard(0.5))[1], "the first")
        put(bob, drive("bob", 0.1))
        put(bob, drive("ann", 0.9, 1))
        put(bob, drive("ann", 0.8, 2))
        put(ann, drive("ann", 0.6, 3))
        wait(lambda: heard(0.6), "the last")
        wait(lambda: session.refused == {bob: 2 * 3}, "each of the three that listen to refuse both")
        wait(lambda: heard(0.6) and exact.by_key, "what was meant for the robot")
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
            session.receive()
            receiver.handover(0.0)
            senders.update(r.sender for r in inlet.take())
            return session.refused[key] > 3 and bool(senders)

        senders: set[str] = set()
        wait(heard, "the player's own, and some of the other's")
        assert senders == {"player/ann/1"}


class Cuttable:
    """A way to a router that can be cut while both ends go on: it passes bytes between two ports.

    Args:
        rate: the bytes that it lets through to the client in a second.
    """

    def __init__(self, endpoint: str, rate: float = math.inf) -> None:
        self._rate = rate
        self._hears = threading.Event()
        self._hears.set()
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
                other.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 14)
                self._ends.append(end)
                threading.Thread(target=self._pass, args=(end, other), daemon=True).start()
                threading.Thread(target=self._pass, args=(other, end, self._hears, self._rate), daemon=True).start()

    @staticmethod
    def _pass(
        source: socket.socket, target: socket.socket, hears: threading.Event | None = None, rate: float = math.inf
    ) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 14):
                if hears is not None:
                    hears.wait()
                    time.sleep(len(data) / rate)
                target.sendall(data)
        with contextlib.suppress(OSError):
            target.shutdown(socket.SHUT_WR)

    def deafen(self) -> None:
        """Let nothing through to the client any more on the links that there are."""
        self._hears.clear()
        self._hears = threading.Event()
        self._hears.set()

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
    with open_session(endpoint) as one, open_session(endpoint) as stranger, open_session(way.endpoint) as other:
        with open_session(endpoint) as third:
            unheard = Pair(stranger, third, CALLS, name="coordinator/other")
            unheard.ready()
            unheard.call(99)
            unheard.until_called(99)
        pair = Pair(one, other, CALLS, LIMITS)
        other.attach(pair.receiver)
        other.declare_alive(KEYS.alive("player", "ann", "1"))
        raw: list[str] = []
        other.watch_raw(KEYS.drive().key, lambda key, _payload: raw.append(key))
        take, watch = other.collect_raw(KEYS.drive().key, 100), other.collect_raw(WATCHED.key, 1)
        assert one.wait_for_listener(CALLS.key, CALLS.qos, PATIENCE)
        pair.call(1)
        pair.until_called(1)
        pair.call(2)
        way.cut()
        lose(other)
        pair.call(3)
        pair.sender.publish(*limit(0.5))
        pair.call(4)
        way.mend()
        wait(lambda: other.connected, "the link to be back")
        pair.call(5)
        pair.until_called(5)
        assert len(opened) == len(set(opened)) == 5, "each with an id of its own"
        assert KEYS.alive("player", "ann", "1") in one.alive(KEYS.alive())
        pair.until(lambda: limited(pair), "the state")

        def drives() -> bool:
            pair.send((KEYS.drive("ann"), m.Drive(twist=STILL)))
            return bool(raw) and bool(take())

        wait(drives, "what is only looked at")
        assert one.wait_for_listener(WATCHED.key, WATCHED.qos, PATIENCE)
        watch.close()
        wait(lambda: not one.wait_for_listener(WATCHED.key, WATCHED.qos, 0.01), "nobody to collect it any more")
        assert watch() == []
        pair.call(6)
        pair.until_called(6)
        assert pair.numbers == [1, 2, 3, 4, 5, 6]


STREAM = f"{KEYS.root}/stream"


def flood(one: Session, witness: Session, rounds: int, then: Callable[[int], object]) -> None:
    """Publish 20 kB in each round, at the pace at which a witness hears it, and call `then` with the round's number."""
    seen: list[str] = []
    witness.watch_raw(STREAM, lambda key, _: seen.append(key), history=False)
    assert one.wait_for_listener(STREAM, Qos.LATEST, PATIENCE)
    for number in range(rounds):
        before = len(seen)
        for _ in range(10):
            one.put_raw(STREAM, bytes(2_000), b"")
        then(number)
        wait(lambda before=before: len(seen) > before or not one.connected, "the stream")  # type: ignore[misc]


def test_a_watcher_behind_a_slow_link_keeps_it_and_loses_no_event(endpoint: str) -> None:
    with (
        contextlib.closing(Cuttable(endpoint, rate=1_000_000)) as way,
        open_session(endpoint) as one,
        open_session(endpoint) as witness,
        open_session(way.endpoint) as watcher,
    ):
        sessions = (one, witness, watcher)
        links = [session._link.raw for session in sessions]
        watcher.watch_raw(STREAM, lambda *_: None, history=False)
        pair = Pair(one, watcher, CALLS, LIMITS, KEYS.clock)
        pair.ready()

        def go_on(number: int) -> None:
            clock = m.Clock(time=float(number), tick=number, epoch=0, rate=1.0, estop=False)
            pair.send(limit(number / 1000), (KEYS.clock, clock))
            pair.call(number)

        flood(one, witness, 300, go_on)  # more than any socket holds
        pair.until_called(299)
        assert pair.numbers == list(range(300))
        pair.until(lambda: limited(pair) == 0.299 and pair.inlets[2].latest, "the newest state, and the clock")
        assert [session._link.raw for session in sessions] == links, "no link was lost"
        way.cut()  # zenoh's close waits for the answer to a query


def test_who_takes_nothing_in_is_thrown_off_and_nobody_else_loses_its_link(endpoint: str, way: Cuttable) -> None:
    with open_session(endpoint) as one, open_session(endpoint) as witness, open_session(way.endpoint) as deaf:
        sessions = (one, witness)
        links = [session._link.raw for session in sessions]
        deaf.watch_raw(f"{KEYS.root}/**", lambda *_: None, history=False)
        pair = Pair(one, witness, CALLS)
        pair.ready()
        way.deafen()

        def go_on(number: int) -> None:
            one._link.put(f"{KEYS.root}/event", Qos.EVENT, bytes(2_000))
            pair.call(number)

        flood(one, witness, 300, go_on)  # more than any socket holds
        pair.until_called(299)
        assert pair.numbers == list(range(300))
        assert [session._link.raw for session in sessions] == links, "no link was lost"


def test_no_message_is_under_a_wrong_key_after_a_cut_of_a_link_on_which_the_router_waits_to_send(
    endpoint: str, way: Cuttable
) -> None:
    """The router then closes it for a quarter of the lease, and zenoh itself connects again meanwhile."""
    names = [f"robot{number}" for number in range(20)]
    with open_session(endpoint) as listener, open_session(endpoint) as camera, open_session(way.endpoint) as one:
        pair = Pair(one, listener, KEYS.drive(), name="player/ann")
        pair.ready()
        one.watch_raw(STREAM, lambda *_: None, history=False)

        def driven(v: float) -> bool:
            pair.send(*((KEYS.drive(name), m.Drive(twist=Twist(v, 0.0))) for name in names))
            heard = pair.inlets[0].by_key
            return len(heard) == len(names) and all(each.body.twist.v == v for each in heard.values())  # type: ignore[attr-defined]

        pair.until(lambda: driven(0.1), "all commands")
        way.deafen()
        flood(camera, listener, 30, lambda _: driven(0.2))  # in less than the lease
        way.cut()
        way.mend()
        pair.until(lambda: driven(0.3) and one.connected, "all commands over the new link")
        assert not listener.refused


def test_what_was_published_while_the_link_was_lost_arrives_once(endpoint: str, way: Cuttable) -> None:
    """The sender's link is cut."""
    with open_session(way.endpoint) as one, open_session(endpoint) as other:
        pair = Pair(one, other, CALLS, LIMITS)
        pair.other.attach(pair.receiver)

        def send(number: int) -> None:
            pair.sender.publish(*limit(0.1 * number))
            pair.call(number)

        assert one.wait_for_listener(CALLS.key, CALLS.qos, PATIENCE)
        send(1)
        send(2)
        pair.until_called(2)
        way.cut()
        lose(one)
        send(3)
        send(4)
        way.mend()
        pair.until_called(4)
        send(5)
        pair.until_called(5)
        assert pair.numbers == [1, 2, 3, 4, 5]
        pair.until(lambda: limited(pair) == 0.5, "the newest state")
        with open_session(endpoint) as late:
            joined = Pair(one, late, CALLS, LIMITS)
            late.attach(joined.receiver)
            joined.until(lambda: limited(joined), "the state, for a late joiner")


def test_events_come_once_and_in_order_however_often_both_links_are_lost(endpoint: str) -> None:
    """The node takes in what has come at once, late, and while it is being asked what was missed."""
    with (
        contextlib.closing(Cuttable(endpoint)) as out,
        contextlib.closing(Cuttable(endpoint)) as back,
        open_session(out.endpoint) as one,
        open_session(back.endpoint) as other,
    ):
        pair = Pair(one, other, CALLS)
        pair.ready()
        numbers = pair.numbers
        sent = turns = 0
        most = 1000

        def go_on() -> bool:
            nonlocal sent, turns
            turns += 1
            if sent < most:
                sent += 1
                pair.call(sent)
            if turns % 3 == 0:
                other.receive()
                pair.receiver.handover(0.0)
                pair.called(sent)
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
        pair.until_called(sent)
        assert numbers == list(range(numbers[0], sent + 1))


def test_a_release_that_could_not_be_given_at_once_is_never_given(endpoint: str, way: Cuttable) -> None:
    """Somebody may have engaged the emergency stop again meanwhile."""
    release = (KEYS.estop_release, m.EstopRelease(by="ann"))
    with open_session(way.endpoint) as one, open_session(endpoint) as other:
        pair = Pair(one, other, KEYS.estop_release, KEYS.estop, name="official/ann")
        pair.ready()
        counts = [0, 0]

        def given() -> list[int]:
            counts[:] = [count + len(inlet.take()) for count, inlet in zip(counts, pair.inlets, strict=True)]
            return counts

        pair.send(release)
        pair.until(lambda: given() == [1, 0], "the first")
        way.cut()
        lose(one)
        pair.send(release)
        pair.send((KEYS.estop, m.Estop(by="ann")))
        way.mend()
        pair.until(lambda: given()[1] == 1, "the emergency stop, which counts whenever it comes")
        assert counts == [1, 1]
        pair.send(release)
        pair.until(lambda: given() == [2, 1], "the next")


def test_a_mailbox_can_be_attached_and_a_listener_waited_for_while_a_link_is_lost(endpoint: str, way: Cuttable) -> None:
    with open_session(way.endpoint) as session, open_session(endpoint) as other:
        listening = Mailbox()
        listening.subscribe(KEYS.estop)
        other.attach(listening)
        way.cut()
        lose(session)
        pair = Pair(other, session, CALLS)
        session.attach(pair.receiver)
        threading.Timer(0.3, way.mend).start()
        assert session.wait_for_listener(KEYS.estop.key, Qos.EVENT, PATIENCE)
        assert other.wait_for_listener(CALLS.key, Qos.EVENT, PATIENCE)
        pair.call(1)
        pair.until_called(1)


def raises(session: Session, kind: type[Exception]) -> bool:
    """Whether taking in messages raises an error of this kind."""
    try:
        session.receive()
    except kind:
        return True
    return False


def test_what_goes_wrong_with_a_link_is_raised_by_receiving(way: Cuttable, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_settings: object) -> None:
        raise OSError("the keys are gone")

    with open_session(way.endpoint) as session:
        monkeypatch.setattr(zenoh, "open", fails)
        way.cut()
        wait(lambda: raises(session, OSError), "the error")


def test_what_another_thread_is_using_is_undeclared_when_it_is_free() -> None:
    class Borrowed:
        tries = 0

        def undeclare(self) -> None:
            self.tries += 1
            if self.tries < 3:
                raise RuntimeError("Already borrowed")

    item = Borrowed()
    _undeclare(item)
    assert item.tries == 3


def test_an_emergency_stop_is_published_before_anybody_is_known_to_listen(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_session(endpoint) as one, open_session(endpoint) as witness:
        heard: list[str] = []
        witness.watch_raw(KEYS.estop.key, lambda key, _payload: heard.append(key))
        asked = Conversation(one, KEYS, Mailbox("commander/a"), patience=PATIENCE)
        asked.mailbox.publish(KEYS.estop, m.Estop(by="ann"))

        def nobody(*_: object) -> bool:
            wait(lambda: bool(heard), "the stop to be heard all the same")
            return False

        monkeypatch.setattr(one, "wait_for_listener", nobody)
        with pytest.raises(BusError, match="no node of match"):
            asked.send(at_once=True)


def test_nobody_at_the_endpoint_is_told_with_what_to_do() -> None:
    told = pytest.raises(BusError, match="start one with `vrg node")
    with told, open_session("tcp/127.0.0.1:1", patience=0.3):
        pass


def test_an_endpoint_that_is_taken_is_told(endpoint: str) -> None:
    with pytest.raises(BusError, match="is another one running there"), open_router(endpoint):
        pass


def test_waiting_for_a_listener_ends_and_closing_twice_is_harmless(endpoint: str) -> None:
    with open_session(endpoint) as one:
        assert not one.wait_for_listener(KEYS.estop.key, Qos.EVENT, 0.1)
        one.close()


def test_the_second_node_of_a_name_is_refused_until_the_first_has_left(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vrg.bus.process.TAKEOVER_TIMEOUT", 0.3)
    with open_session(endpoint) as other:
        with open_session(endpoint) as one:
            assert claim(one, KEYS, "coordinator", "referee", threading.Event())
            wait(lambda: other.alive(KEYS.alive("coordinator", "referee")), "the token of the first")
            with pytest.raises(DuplicateNodeError, match="already has a coordinator named 'referee'"):
                claim(other, KEYS, "coordinator", "referee", threading.Event())
            assert claim(other, KEYS, "player", "referee", threading.Event())
        monkeypatch.undo()
        assert claim(other, KEYS, "coordinator", "referee", threading.Event())


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


def test_a_failing_node_stops_its_robot_and_is_not_swallowed(
    sessions: tuple[Session, Session], world: threading.Event
) -> None:
    pair = Pair(*sessions, KEYS.drive())
    pair.other.attach(pair.receiver)
    with pytest.raises(ZeroDivisionError):
        run_node(Listener(fails_at=0.0), sessions[0], KEYS, threading.Event())
    pair.until(lambda: pair.inlets[0].latest, "the last command")
    assert not pair.inlets[0].latest.body.armed


def test_missed_ticks_are_counted(sessions: tuple[Session, Session]) -> None:
    node, stop = Listener(), threading.Event()
    session, other = sessions
    world = Pair(other, session)
    results: list[object] = []
    thread = threading.Thread(target=lambda: results.append(run_node(node, session, KEYS, stop)))
    thread.start()
    assert other.wait_for_listener(KEYS.clock.key, Qos.LATEST, PATIENCE)
    for tick in (0, 5, 35):
        before = len(node.seen)
        world.sender.handover(tick * 0.02)
        world.send((KEYS.clock, m.Clock(time=tick * 0.02, tick=tick, epoch=0, rate=1.0, estop=False)))
        wait(lambda before=before: len(node.seen) > before, "a tick")  # type: ignore[misc]
    stop.set()
    thread.join(PATIENCE)
    assert results[0].missed == 5  # type: ignore[attr-defined]


def test_of_a_flood_the_newest_state_counts_and_events_are_dropped(sessions: tuple[Session, Session]) -> None:
    """The clock of a world that is a hundred times as fast as real time comes 5,000 times a second."""
    pair = Pair(*sessions, CALLS, KEYS.clock, name="world/world")
    pair.ready()
    number = 3 * MAX_MESSAGE_RATE
    for tick in range(number):
        pair.sender.publish(KEYS.clock, m.Clock(time=tick * 0.02, tick=tick, epoch=0, rate=100.0, estop=False))
        pair.sender.publish(CALLS, call(tick))

    def newest() -> bool:
        # A clock goes on: one that finds no room is dropped, and the next one finds it.
        pair.send((KEYS.clock, m.Clock(time=1e6, tick=10**7, epoch=0, rate=100.0, estop=False)))
        pair.called(number)
        latest = pair.inlets[1].latest
        return latest is not None and latest.body.tick == 10**7

    other = sessions[1]
    pair.until(newest, "the newest clock")
    pair.until(lambda: newest() and other.dropped, "events to be dropped")
    assert pair.numbers == sorted(pair.numbers)
    assert len(pair.numbers) < number
    assert not other.refused


def test_an_alarm_that_fails_is_raised_by_the_next_look(sessions: tuple[Session, Session]) -> None:
    def fail(_: object) -> None:
        raise ValueError("broken")

    pair = Pair(*sessions, name="official/ann")
    pair.inlets = [pair.receiver.subscribe(KEYS.estop, alarm=fail)]
    pair.ready()
    pair.send((KEYS.estop, m.Estop(by="ann")))
    wait(lambda: raises(sessions[1], ValueError), "the failure")
