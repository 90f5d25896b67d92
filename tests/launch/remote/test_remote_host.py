"""What an agent can do to its launcher, and what it cannot: it may be lost, or slow, or send anything."""

import contextlib
import math
import shlex
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec import Struct

from tests.test_machines import MACHINES, load
from vrg import __version__
from vrg.bus.messages import ProcessState, ProcessStatus
from vrg.errors import LaunchError, MessageError
from vrg.launch.listening import Listening
from vrg.launch.remote import wire
from vrg.launch.remote.remote_host import AGENT_TIMEOUT, AWAY_TIMEOUT, RECONNECT_PERIOD, RemoteHost, StartupStep
from vrg.launch.remote.silence import MAX_PAUSE
from vrg.launch.remote.wire import BANNER, Frames, frame
from vrg.runs.events import EventKind, EventLog, read_events
from vrg.runs.run_folder import RunFolder

PATIENCE = 60.0
"""s of real time"""


class Bench:
    """A machine whose agent is this test: what ssh would bring comes from a file, and orders go into another one.

    Attributes:
        host: the machine. folder: the run folder. told: what a person was told. now: the time on the host's clock, s.
    """

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._folder, self._environment, self._agents = folder, monkeypatch, 0
        setup = load(folder, more=MACHINES + '[place]\nworld = "lab2"', ann='machine = "lab2"', bob='machine = "lab3"')
        self.folder = RunFolder(folder / "run")
        self.folder.prepare()
        self.folder.match_file.write_bytes(b"the match")
        (self.folder.logs / "referee.log").write_bytes(b"the referee's\n")
        self.told: list[str] = []
        self.now = 1000.0
        notes = Listening(setup.keys, EventLog(self.folder.events), ["ann", "bob"])
        prepare = wire.Prepare("run", "lab2", None, None, False, False, "", {})
        self.host = RemoteHost(setup, self.folder, prepare, self.told.append, notes, clock=lambda: self.now)
        self.again()

    def again(self) -> None:
        """Another agent is there, which has sent nothing; the one before may not have ended."""
        self._agents += 1
        self._answers = self._folder / f"answers{self._agents}"
        self._orders = self._folder / f"orders{self._agents}"
        script = f"exec 3<&0; cat <&3 >>{self._orders} & exec tail -c +1 -f {self._answers}"
        self._environment.setenv("VRG_SSH", f"sh -c {shlex.quote(script)}")
        self._answers.write_bytes(BANNER)
        self._orders.write_bytes(b"")
        self._read, self._numbers = 0, 0
        self._frames: Frames[wire.ToAgent] = Frames(wire.ToAgent)  # type: ignore[arg-type]

    def send(self, *messages: Struct) -> None:
        """Send something as the agent."""
        self.send_bytes(b"".join(map(frame, messages)))

    def send_bytes(self, data: bytes) -> None:
        with self._answers.open("ab") as answers:
            answers.write(data)

    def orders(self) -> list[wire.ToAgent]:
        """What the launcher has ordered since the last call; all is answered as an agent does."""
        data = self._orders.read_bytes()[self._read :]
        self._read += len(data)
        self._frames.feed(data)
        found = list(iter(self._frames.next, None))
        for order in found:
            self._numbers += 1
            if isinstance(order, wire.Load):
                self.send(wire.Loaded("tcp/10.0.0.2:7447", []))
            if not isinstance(order, wire.FilePart | wire.Beat):
                self.send(wire.Done(self._numbers))
        return found

    def look(self, condition: Callable[[], bool]) -> list[wire.ToAgent]:
        """Look at the machine until a condition holds, and return what was ordered; time stands on the host's clock."""
        deadline, ordered = time.monotonic() + PATIENCE, []
        while not condition():
            assert time.monotonic() < deadline, self.told
            ordered += self.orders()
            self.host.poll()
            time.sleep(0.002)
        return ordered

    def play(self) -> list[wire.ToAgent]:
        """Bring it up, and return what was ordered."""
        self.send(wire.Hello(__version__, "10.0.0.1", "/home"))
        self.host.aim(StartupStep.PLAYS)
        return self.look(lambda: self.host.is_at(StartupStep.PLAYS))


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    made = Bench(tmp_path, monkeypatch)
    yield made

    def goes_on() -> None:
        made.now += 0.5  # an agent that has not answered, as this one may not have, would be waited for without end

    made.host.close(goes_on)


@pytest.fixture
def playing(bench: Bench) -> Bench:
    """One that plays."""
    bench.play()
    return bench


def status(name: str, machine: str = "lab2", node: str = "player/ann") -> ProcessStatus:
    return ProcessStatus(name=name, machine=machine, state=ProcessState.RUNNING, node=node)


def test_a_machine_is_brought_up_step_by_step_as_far_as_it_is_asked_to(bench: Bench) -> None:
    host = bench.host
    assert (host.names, host.stop_orders) == (["world", "ann"], [0, 2]), "the match file tells that, and no agent"
    bench.send(wire.Hello(__version__, "10.0.0.1", "/home"))
    ordered = bench.look(lambda: host.is_at(StartupStep.LOADED))
    kinds = [type(order) for order in ordered if not isinstance(order, wire.FilePart | wire.Beat)]
    assert kinds == [wire.Prepare, wire.Load]
    assert (host.reports.endpoint, host.reports.peer) == ("tcp/10.0.0.2:7447", "10.0.0.1")
    for _ in range(5):
        host.keep()
    assert not any(isinstance(order, wire.Serve) for order in bench.orders())
    host.router = "tcp/10.0.0.1:7447"
    host.aim(StartupStep.FIRST)
    later = bench.look(lambda: host.is_at(StartupStep.FIRST))
    serves = [wire.Serve("tcp/10.0.0.1:7447", None), wire.Join(), wire.Begin(1, [])]
    assert [order for order in later if not isinstance(order, wire.Beat)] == serves
    assert host.trouble is None


def test_a_machine_that_was_lost_is_brought_up_the_same_way(bench: Bench) -> None:
    first = bench.play()
    bench.send(wire.Noted(EventKind.VACATED, "ann", "it fails"))
    bench.look(lambda: bool(bench.host.take_failed()))
    bench.send_bytes(b"\xff" * 8)
    bench.look(lambda: not bench.host.is_at(StartupStep.LOADED))
    assert bench.told[-1].startswith("lab2 is away (world, ann): its robots stand still; VRG tries again")
    assert bench.host.trouble == "lab2 does not answer (world, ann)"
    bench.again()
    bench.now += RECONNECT_PERIOD
    second = bench.play()
    assert bench.told[-1] == "lab2 is back: world, ann run again"
    assert [type(o) for o in first if type(o) is not wire.Beat] == [type(o) for o in second if type(o) is not wire.Beat]
    assert wire.Begin(2, ["ann"]) in second
    assert bench.host.trouble is None


RUBBISH = {
    "no frame": b"\xff" * 8,
    "no message": b"\0\0\0\x01\x05",
    "another type": frame(wire.Done(1)).replace(b"order", b"ordre"),
    "an order": frame(wire.Goodbye()),
    "an order that was not given": frame(wire.Done(10**6)),
    "an address that is none": frame(wire.Hello(__version__, "x" * 100, "/home")),
    "another machine's process": frame(wire.Noted(EventKind.DIED, "bob")),
    "a player of another machine": frame(wire.Noted(EventKind.VACATED, "bob", "it fails")),
    "a process that is no player": frame(wire.Noted(EventKind.VACATED, "world", "it fails")),
    "what happens to no process": frame(wire.Noted(EventKind.ENDED, "ann")),
    "another process' state": frame(wire.Status([status("bob")], 0.0, 0.0, 0.0)),
    "a state for another machine": frame(wire.Status([status("ann", "lab3")], 0.0, 0.0, 0.0)),
    "another node's state": frame(wire.Status([status("ann", node="x" * 100_000)], 0.0, 0.0, 0.0)),
    "a state twice": frame(wire.Status([status("ann")] * 2, 0.0, 0.0, 0.0)),
    "another process' log": frame(wire.LogText("bob", b"forged\n", 7)),
    "a log elsewhere": frame(wire.LogText("../../evil", b"forged\n", 7)),
    "a log with a name that is none": frame(wire.LogText("a\0b", b"forged\n", 7)),
    "a file that was not asked for": frame(wire.FilePart("journal.jsonl", b"forged\n", begins=True)),
}


@pytest.mark.parametrize("rubbish", RUBBISH.values(), ids=RUBBISH)
def test_an_agent_that_sends_rubbish_costs_its_own_machine_only(playing: Bench, rubbish: bytes) -> None:
    """It is given up and tried again, as if it were away."""
    playing.send_bytes(rubbish)
    playing.look(lambda: not playing.host.is_at(StartupStep.LOADED))
    assert "its agent has sent an invalid message: " in playing.told[0]
    assert playing.host.take_failed() == {}
    assert not playing.folder.events.exists()
    assert not list(playing.folder.path.parent.rglob("*evil*"))


TEXTS = st.sampled_from(
    ["ann", "world", "bob", "", "..", "/", "a\0b", "x" * 5000, "\x1b[2J", "match.toml", "logs/ann.log"]
)
WHOLE = st.sampled_from([0, 1, -1, (1 << 63) - 1, -(1 << 63)])
REAL = st.sampled_from([0.0, 1.0, math.nan, math.inf, -math.inf, 1e308])
YES = st.booleans()
STATES = st.builds(
    ProcessStatus, name=st.sampled_from(["ann", "bob"]), machine=st.sampled_from(["lab2", ".."]), node=TEXTS,
    state=st.sampled_from(ProcessState),
)  # fmt: skip
ANYTHING = st.one_of(
    st.builds(wire.FilePart, path=TEXTS, data=st.binary(max_size=9), begins=YES),
    st.builds(wire.Hello, version=st.sampled_from([__version__, ""]), peer=TEXTS, home=TEXTS),
    st.builds(wire.Loaded, endpoint=TEXTS, findings=st.just([])),
    st.builds(wire.Done, order=WHOLE),
    st.builds(wire.Failed, text=TEXTS),
    st.builds(wire.Notice, text=TEXTS),
    st.builds(wire.Noted, st.sampled_from(EventKind), TEXTS, TEXTS, st.none() | WHOLE, YES),
    st.builds(wire.LogText, name=TEXTS, text=st.binary(max_size=9), end=WHOLE),
    st.builds(wire.Status, processes=st.lists(STATES, max_size=3), beat=REAL, held=REAL, wall=REAL),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(messages=st.lists(ANYTHING, max_size=8))
def test_nothing_that_an_agent_sends_raises_what_is_not_expected(bench: Bench, messages: list[wire.ToLauncher]) -> None:
    frames: Frames[wire.ToLauncher] = Frames(wire.ToLauncher)  # type: ignore[arg-type]
    for message in messages:
        frames.feed(frame(message))
        with contextlib.suppress(MessageError, LaunchError):
            bench.host.reports.take(frames.next(), 3, starting=False, fetching=True)
    assert set(bench.host.names) <= {"ann", "world"}
    assert set(bench.host.take_failed()) <= {"ann"}
    assert bench.folder.match_file.read_bytes() == b"the match"
    assert {path.name for path in bench.folder.path.parent.iterdir()} == {"answers1", "orders1", "match.toml", "run"}


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 1e308])
def test_numbers_that_mean_nothing_do_no_harm(playing: Bench, value: float) -> None:
    playing.send(wire.Status([status("ann")], value, value, value), wire.LogText("ann", b"hello\n", -(1 << 63)))
    playing.look(lambda: playing.host.names == ["ann"] and (playing.folder.logs / "ann.log").exists())
    assert playing.host.is_at(StartupStep.PLAYS)


def test_nothing_waits_for_an_ssh_that_does_not_end(playing: Bench) -> None:
    connection = playing.host._connection
    assert connection is not None
    connection.process.send_signal(signal.SIGSTOP)
    # It must have stopped: of several signals that are pending, the one that ends it would be taken first.
    deadline = time.monotonic() + 60.0
    while psutil.Process(connection.process.pid).status() != psutil.STATUS_STOPPED:
        assert time.monotonic() < deadline, "it does not stop"
        time.sleep(0.01)
    while playing.host.is_at(StartupStep.LOADED):
        playing.now += MAX_PAUSE
    assert not connection.gone, "it was not waited for"
    playing.again()
    playing.now += RECONNECT_PERIOD
    playing.play()
    assert not connection.gone, "the machine is back although it has not ended"
    connection.process.kill()


def test_only_an_honest_failure_ends_the_match(playing: Bench) -> None:
    playing.send(wire.Failed("world was killed by signal 9, too often to continue"))
    with pytest.raises(LaunchError, match="lab2: world was killed by signal 9, too often to continue"):
        playing.look(lambda: False)


def test_before_the_match_a_machine_that_fails_is_not_waited_for(bench: Bench) -> None:
    bench.send_bytes(b"\xff" * 8)
    with pytest.raises(LaunchError, match="lab2: its agent has sent an invalid message: expected a frame"):
        bench.look(lambda: False)


def test_an_agent_changes_what_its_own_processes_have_written_and_nothing_else(playing: Bench) -> None:
    playing.folder.journal.write_bytes(b"the journal\n")  # once the match runs
    (playing.folder.logs / "world.log").write_bytes(b"of this machine\n")
    playing.send(wire.LogText("ann", b"hello\n", 6), wire.LogText("world", b"forged\n", 7))
    playing.look(lambda: len(playing.told) > 0)
    playing.host.fetch()
    for _ in range(2):
        for path in ("match.toml", "journal.jsonl", "../evil", "a\0b", "x" * 5000, "players/ann/notes"):
            playing.send(wire.FilePart(path, b"forged\n", begins=True))
    playing.send(wire.LogText("ann", b"hello\n", 12))
    playing.look(lambda: (playing.folder.logs / "ann.log").read_bytes() == b"hello\nhello\n")
    assert (playing.folder.path / "players" / "ann" / "notes").read_bytes() == b"forged\n"
    assert (playing.folder.logs / "world.log").read_bytes() == b"of this machine\n"
    assert playing.folder.match_file.read_bytes() == b"the match"
    assert playing.folder.journal.read_bytes() == b"the journal\n"
    assert not list(playing.folder.path.parent.rglob("*evil*"))
    assert playing.told[0] == "lab2: 'logs/world.log' cannot be kept: the run folder has such a file already"
    assert len(playing.told) == 5, "each is told once"
    assert playing.host.is_at(StartupStep.PLAYS)


def test_an_agent_that_sends_no_files_does_not_hold_up_the_end(playing: Bench) -> None:
    playing.send(wire.Status([status("ann")], 0.0, 0.0, 0.0))
    playing.look(lambda: playing.host.names == ["ann"])
    playing.host.fetch()

    def goes_on() -> None:
        playing.now += 0.1
        playing.send(wire.Status([status("ann")], 0.0, 0.0, 0.0))

    playing.host.close(goes_on)
    assert playing.told == ["the files of the processes on lab2 were not fetched; they are there in /home/run"]


def test_what_happens_to_its_processes_is_noted(playing: Bench) -> None:
    playing.send(
        wire.Noted(EventKind.DIED, "ann", "was killed by signal 9", -9),
        wire.Noted(EventKind.VACATED, "ann", "bad"),
    )
    playing.look(playing.folder.events.exists)
    playing.look(lambda: len(read_events(playing.folder.events)) == 2)
    assert playing.host.take_failed() == {"ann": "bad"}


def test_a_flood_of_an_agent_is_taken_in_bit_by_bit(playing: Bench) -> None:
    playing.send(*[wire.Notice("x" * 10_000)] * 1000)
    seen, deadline = 0, time.monotonic() + PATIENCE
    while seen < 1000:
        assert time.monotonic() < deadline, f"{seen} have come"
        playing.host.poll()
        assert len(playing.told) - seen < 100, "others have their turn"
        seen = len(playing.told)
    assert max(map(len, playing.told)) < 5000


def test_a_machine_is_quiet_and_then_away_when_the_launcher_has_heard_nothing_for_so_long(playing: Bench) -> None:

    def silent(until: Callable[[], bool]) -> float:
        began = playing.now
        while not until():
            playing.now += 0.05
            playing.host.poll()
        return playing.now - began

    assert silent(lambda: playing.host.trouble is not None) == pytest.approx(AGENT_TIMEOUT, abs=0.2)
    assert silent(lambda: not playing.host.is_at(StartupStep.LOADED)) == pytest.approx(
        AWAY_TIMEOUT - AGENT_TIMEOUT, abs=0.2
    )
    assert "(nothing was heard from robot@lab2.local for 12 s)" in playing.told[-1]


def test_time_in_which_the_launcher_did_not_run_is_no_silence_of_a_machine(playing: Bench) -> None:
    for _ in range(int(AGENT_TIMEOUT / MAX_PAUSE) - 1):
        playing.now += 3600.0
        playing.host.poll()
    assert playing.host.trouble is None
    playing.send(wire.Status([status("ann")], 0.0, 0.0, 0.0))
    playing.look(lambda: playing.host.names == ["ann"])
    playing.now += 3600.0
    playing.host.poll()
    assert playing.host.trouble is None
