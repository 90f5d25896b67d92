"""The launcher's log of what happens to processes, and what it hears on the bus for it."""

import itertools
import time
from collections.abc import Callable, Collection
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.bus.codec import Received, encode
from vrg.bus.messages import Clock, Estop, EstopRelease, MeasuredPose, Message, Report
from vrg.bus.topics import Keys, Topic, key_matches
from vrg.launch.listening import LATCHES, Listening
from vrg.recording.stops import REST_TIME
from vrg.runs.events import Event, EventKind, EventLog, read_events
from vrg.types import Pose, Twist

KEYS = Keys("test")

events = st.builds(
    Event,
    what=st.sampled_from(EventKind),
    monotonic=st.floats(0, 1e9),
    time=st.none() | st.floats(0, 1e8),
    process=st.none() | st.text(min_size=1),
    text=st.text(),
    status=st.none() | st.integers(-64, 255),
    newest=st.dictionaries(st.text(), st.floats(0, 1e6), max_size=3),
    x=st.floats(-1e5, 1e5),
)


@given(st.lists(events, max_size=5))
def test_what_is_written_is_read_back(tmp_path_factory: pytest.TempPathFactory, written: list[Event]) -> None:
    path = tmp_path_factory.mktemp("events") / "events.jsonl"
    path.touch()
    log = EventLog(path)
    for event in written:
        log.write(event)
    assert read_events(path) == written


def test_a_last_line_that_is_torn_loses_nothing_else(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "events.jsonl"
    log = EventLog(path)
    event = Event(what=EventKind.DIED, monotonic=1.0, process="ann", status=-9)
    log.write(event)
    log.write(event)
    path.write_bytes(path.read_bytes()[:-10])
    assert read_events(path) == [event]
    assert "left out a torn last line of" in caplog.text


def test_a_log_that_cannot_be_written_is_told_once_only(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    log = EventLog(tmp_path / "missing" / "events.jsonl")
    for _ in range(3):
        log.write(Event(what=EventKind.BEGAN, monotonic=0.0))
    assert caplog.text.count("cannot be written") == 1


class FakeSession:
    """Brings messages to who listens, as a session of the bus does."""

    def __init__(self) -> None:
        self._raw: list[tuple[Collection[str], Callable[[str, bytes], None]]] = []

    def watch_raw(
        self, expression: str, arrived: Callable[[str, bytes], None], *, history: bool, only: Collection[str]
    ) -> None:
        assert all(key_matches(expression, key) for key in only)
        self._raw.append((only, arrived))

    def say(self, topic: Topic[Message], body: Message, stamp: float, sequence: int) -> None:
        self.say_raw(topic.key, encode(Received(topic.key, stamp, sequence, body)))

    def say_raw(self, key: str, payload: bytes) -> None:
        for only, arrived in self._raw:
            if key in only:
                arrived(key, payload)


class Bench:
    """A launcher's ear, and what it logs."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.path = folder / "events.jsonl"
        self.now = 100.0
        monkeypatch.setattr(time, "monotonic", lambda: self.now)
        self.session = FakeSession()
        self.listening = Listening(KEYS, EventLog(self.path), ["ann", "bob", "cid"])
        self.listening.attach(self.session)  # type: ignore[arg-type]
        self._clocks = 0

    def clock(self, at: float, *, estop: bool = False) -> None:
        clock = Clock(time=at, tick=round(at * 50), epoch=0, rate=1.0, estop=estop)
        self.session.say(KEYS.clock, clock, at, self._clocks)
        self._clocks += 1

    def estop(self, by: str, reason: str = "", number: int = 0) -> None:
        self.session.say(KEYS.estop, Estop(by=by, reason=reason), 0.0, number)

    def release(self, by: str, number: int = 0) -> None:
        self.session.say(KEYS.estop_release, EstopRelease(by=by), 0.0, number)

    def report(self, player: str, at: float, sequence: int) -> None:
        self.session.say(KEYS.report(player), Report(mode="Play", armed=True), at, sequence)

    def events(self) -> list[Event]:
        """The log, once no order waits any more for the world to latch it."""
        self.listening.look()
        self.now += LATCHES + 0.1
        self.listening.look()
        return read_events(self.path)


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(tmp_path, monkeypatch)


def test_an_event_has_the_match_time_and_that_of_each_senders_newest_message(bench: Bench) -> None:
    bench.clock(4.0)
    bench.report("ann", 3.9, 7)
    bench.now = 100.25
    bench.clock(4.26)
    bench.now = 100.3
    bench.listening.note(EventKind.DIED, "ann", "was killed by signal 9", status=-9)
    [event] = bench.events()
    assert (event.what, event.process, event.status, event.time) == (EventKind.DIED, "ann", -9, 4.26)
    assert (event.monotonic, event.clock) == (100.3, 100.25)
    assert event.newest == {"ann": 3.9, "world": 4.26}


def test_an_emergency_stop_has_the_match_time_from_which_the_world_has_latched_it(bench: Bench) -> None:
    """On a busy machine its order overtakes clocks that are on the way."""
    bench.clock(4.0)
    bench.estop("ann")
    bench.now = 100.3
    bench.clock(4.1)
    bench.clock(4.2, estop=True)
    [event] = bench.events()
    assert (event.what, event.time, event.monotonic) == (EventKind.ESTOP, 4.2, 100.0)


def test_an_emergency_stop_that_no_world_latches_has_the_time_of_its_arrival_not_of_the_look(bench: Bench) -> None:
    bench.clock(4.0)
    bench.now = 100.01
    bench.estop("ann", "a dog")
    bench.listening.look()
    assert not bench.path.exists(), "the world may still latch it"
    bench.now = 100.03
    bench.clock(4.04)
    bench.release("ann", 1)
    first, second = bench.events()
    assert (first.what, first.text, first.time, first.monotonic) == (EventKind.ESTOP, "by ann: a dog", 4.0, 100.01)
    assert second.what is EventKind.RELEASE


def test_what_comes_while_the_launcher_looks_keeps_its_own_time_and_its_place_among_the_others(bench: Bench) -> None:
    bench.clock(4.0)
    bench.listening.look()
    bench.now = 100.02
    bench.estop("ann")
    bench.now = 100.5  # the launcher is busy, and match time goes on
    bench.clock(4.5)
    bench.release("eve")
    assert [(event.what, event.time, event.monotonic) for event in bench.events()] == [
        (EventKind.ESTOP, 4.0, 100.02),
        (EventKind.RELEASE, 4.5, 100.5),
    ]


def test_of_a_flood_of_orders_only_those_are_logged_that_change_something(bench: Bench) -> None:
    bench.clock(4.0)
    for number in range(2000):
        bench.estop("ann", "x" * 80, number)
    for number in range(3):
        bench.release("eve", number)
    bench.estop("bob")
    first, release, second = bench.events()
    assert (first.what, release.what, second.what) == (EventKind.ESTOP, EventKind.RELEASE, EventKind.ESTOP)
    assert release.text == "by eve (1999 more orders to engage it changed nothing)"
    assert second.text == "by bob"


def test_an_order_is_logged_after_a_release_that_was_not_heard(bench: Bench) -> None:
    bench.estop("ann")
    bench.clock(4.0)
    bench.clock(4.1, estop=True)
    bench.clock(7.0, estop=False)
    bench.estop("bob")
    assert [event.text for event in bench.events()] == ["by ann", "by bob"]


def test_a_world_that_steps_back_is_logged_and_who_waits_for_its_clock_is_told(bench: Bench) -> None:
    bench.clock(4.0)
    bench.listening.look()
    bench.listening.note_at_next_clock(EventKind.READY, "router")
    assert bench.path.exists() is False
    bench.clock(3.9)
    back, ready = bench.events()
    assert (back.what, back.process, back.time) == (EventKind.STEPPED_BACK, "world", 3.9)
    assert (ready.what, ready.process, ready.time) == (EventKind.READY, "router", 3.9)


@pytest.fixture
def robot(bench: Bench) -> "Physical":
    return Physical(bench)


class Physical:
    """A physical robot on the bench that is measured every 0.02 s."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        bench.clock(4.0)

    def drives(self, v: float, seconds: float, *, every: float = 0.02) -> None:
        for _ in range(round(seconds / every)):
            self._bench.now += every
            pose = MeasuredPose(pose=Pose(v, 1.0, 0.0), twist=Twist(v, 0.0))
            self._bench.session.say(KEYS.robot_pose("ann"), pose, 4.0, 0)

    def logged(self) -> list[tuple[float, float]]:
        """(the real time since the clock, s; the speed, m/s) of each pose in the log."""
        found = [event for event in self._bench.events() if event.what is EventKind.MEASURED]
        return [(round(event.monotonic - 100.0, 2), event.v) for event in found]


def test_physical_robots_are_logged_while_match_time_stands_until_they_have_stood_for_a_while(robot: Physical) -> None:
    for v, seconds in ((0.9, 0.1), (0.8, 0.04), (0.0, 1.0)):
        robot.drives(v, seconds)
    logged = robot.logged()
    assert logged[:3] == [(0.12, 0.8), (0.14, 0.8), (0.16, 0.0)]
    begin, end = logged[2][0], logged[-1][0]
    assert REST_TIME <= end - begin <= REST_TIME + 0.04
    assert {v for _, v in logged[2:]} == {0.0}


def test_a_physical_robot_that_rests_for_a_moment_or_moves_again_is_logged_on(robot: Physical) -> None:
    for v, seconds in ((0.9, 0.2), (0.0, 0.04), (0.5, 0.1), (0.0, 2.0), (0.3, 0.1), (0.0, 2.0)):
        robot.drives(v, seconds)
    speeds = [v for v, _ in itertools.groupby(v for _, v in robot.logged())]
    assert speeds == [0.9, 0.0, 0.5, 0.0, 0.3, 0.0]


def test_a_physical_robot_that_rests_when_match_time_goes_on_is_logged_until_it_stands(
    bench: Bench, robot: Physical
) -> None:
    robot.drives(0.5, 0.2)
    robot.drives(0.0, 0.04)
    bench.listening.look()
    bench.clock(4.02)
    robot.drives(0.0, 0.04)
    robot.drives(0.4, 0.04)
    assert [v for _, v in robot.logged()][-5:] == [0.0, 0.0, 0.0, 0.0, 0.4]


def test_a_robot_that_is_measured_very_often_or_moves_for_ever_fills_no_disk(robot: Physical) -> None:
    robot.drives(0.5, 2.0, every=0.001)
    assert len(robot.logged()) <= 200
    robot.drives(0.5, 60.0, every=0.5)
    assert robot.logged()[-1][0] <= 10.0


@pytest.mark.parametrize("payload", [b"", b"\xc1", b"\x94\x01\x02\x03\x04", b"\x81\xa1a\x01"])
def test_what_is_no_message_is_passed_over(bench: Bench, payload: bytes) -> None:
    for topic in (KEYS.clock, KEYS.report("ann"), KEYS.robot_pose("ann"), KEYS.referee_state):
        bench.session.say_raw(topic.key, payload)
    bench.listening.note(EventKind.ENDED)
    last = bench.events()[-1]
    assert last.time is None
    assert "world" not in last.newest
