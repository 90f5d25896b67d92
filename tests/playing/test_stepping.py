"""Matches in lockstep over processes: the same as in one process, whatever becomes of the players' processes."""

import itertools
import os
import re
import shutil
import signal
import socket
import time
from collections.abc import Iterator
from datetime import datetime
from functools import partial
from pathlib import Path
from threading import Event as Stop
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from vrg.agents.messages import Payload
from vrg.agents.radio import TeamMessage
from vrg.agents.strategy import ForfeitError, Strategy, View
from vrg.blame import DecisionTimeoutError
from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Node, Tick
from vrg.config.loading import load_match
from vrg.config.rules import rulebook_of
from vrg.config.setup import MatchSetup, write_setup
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Observation
from vrg.errors import LaunchError, StrategyError
from vrg.hal.models import robot_model
from vrg.hal.readings import Readings
from vrg.launch.fork_server import Child, ForkServer, fork_server
from vrg.launch.nodes.referee import open_journal
from vrg.launch.remote.wire import frame
from vrg.launch.sandbox.seal import missing
from vrg.playing import apart, in_process
from vrg.playing.apart import BUDGET, StrategyHere, SubprocessStrategy
from vrg.playing.branch import play_branch, repeat_match
from vrg.playing.in_process import Ending
from vrg.playing.stepped import SteppedPlayer
from vrg.playing.strategies import Strategies
from vrg.playing.strategy_process import Decision, Failed, Ready
from vrg.runs.change import Change
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder
from vrg.runs.step_log import Digest, Line, Missed, StepLog, Unmade, read_steps
from vrg.testing.command_line import invoke
from vrg.testing.tiny import TINY
from vrg.types import Pose, Twist

MATCH = TINY.replace('name = "ann"', 'name = "ann"\nstrategy = "odd.py:Odd"')
ODD = """
import os, time
from vrg.agents import Action, Strategy, Twist
if os.path.exists("HOME/broken"):
    raise RuntimeError("it cannot be imported any more")
class Odd(Strategy):
    count = 0
    def act(self, view):
        self.count += 1
        with open("HOME/pid", "w") as file:
            file.write(str(os.getpid()))
        if self.count == 20 and os.path.exists("HOME/slow"):
            time.sleep(0.6)
        if self.count == 20 and os.path.exists("HOME/hangs"):
            time.sleep(1000.0)
        if self.count > 20 and os.path.exists("HOME/slower"):
            time.sleep(0.3)
        if self.count == 20 and os.path.exists("HOME/raises"):
            raise RuntimeError("twenty")
        if self.count == 40 and os.path.exists("HOME/once"):
            open("HOME/broken", "w").close()
            os._exit(1)
        return Action(Twist(0.4, 0.2 * (-1) ** (self.count // 15)), "Circle")
"""
DRIVES = """
from vrg.agents import Strategy, Twist
class Odd(Strategy):
    count = 0
    def act(self, view):
        self.count += 1
        return TWIST
"""
NOW = datetime(2026, 11, 25)


class Killer(Node):
    """Sends the process of the odd strategy a signal at an instant."""

    kind = "spectator"

    def __init__(self, at: float, number: int) -> None:
        super().__init__("killer", Mailbox(), 0.1)
        self._at, self._number = at, number

    def tick(self, tick: Tick) -> None:
        if abs(tick.time - self._at) < 0.01:
            os.kill(int(Path("pid").read_text()), self._number)


class Slow(Node):
    """Lets real time pass with match time."""

    kind = "spectator"

    def __init__(self) -> None:
        super().__init__("slow", Mailbox(), 0.1)

    def tick(self, tick: Tick) -> None:
        time.sleep(0.05)


@pytest.fixture(scope="module")
def server() -> Iterator[ForkServer]:
    with fork_server() as started:
        yield started


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tiny.toml").write_text(MATCH)
    (tmp_path / "odd.py").write_text(ODD.replace("HOME", str(tmp_path)))
    return tmp_path


def play(home: Path, name: str, apart: Strategies | None, *watchers: Node) -> tuple[RunFolder, Ending]:
    setup = load_match(home / "tiny.toml").at_rate(0.0)
    folder = RunFolder.create(home / name, setup.name, NOW)
    keep(setup, folder)
    write_setup(setup, folder.setup)
    with open_journal(setup, folder) as journal, StepLog(folder.steps) as steps:
        options: Any = {"limit": 9.0, "logs": folder.logs, "apart": apart, "steps": steps}
        ending = in_process.play(setup, journal, watchers=watchers, **options)
    return folder, ending


def repeated(of: RunFolder, home: Path, name: str, apart: Strategies | None) -> RunFolder:
    for file in ("slow", "slower", "raises", "broken", "once"):
        (home / file).unlink(missing_ok=True)
    return repeat_match(of, home / name, NOW, apart, Stop())  # type: ignore[arg-type]


def missed(folder: RunFolder) -> list[Missed]:
    return [line for line in read_steps(folder.steps) if isinstance(line, Missed)]


def same(one: RunFolder, other: RunFolder) -> None:
    for file in ("journal.jsonl", "evidence.bin", "steps.jsonl"):
        assert (one.path / file).read_bytes() == (other.path / file).read_bytes(), file


def test_over_processes_a_match_is_the_same_as_in_one(home: Path, server: ForkServer) -> None:
    alone, _ = play(home, "alone", None)
    spread, _ = play(home, "spread", Strategies(server, every=True, deadline=60.0))
    same(alone, spread)
    digests = [line for line in read_steps(alone.steps) if isinstance(line, Digest)]
    assert len(digests) > 7
    assert {"world/world", "coordinator/referee", "player/ann"} <= set(digests[3].nodes)


def test_what_a_player_is_too_late_for_is_forfeited_in_a_repetition_too(home: Path, server: ForkServer) -> None:
    (home / "slow").touch()
    folder, ending = play(home, "late", Strategies(server, every=True, deadline=0.1))
    found = missed(folder)
    assert {line.player for line in found} >= {"ann"}
    first = next(line for line in found if line.player == "ann")
    assert first.asked, "it was asked, and its answer came too late"
    assert not ending.failures
    same(folder, repeated(folder, home, "again", None))
    same(folder, repeated(folder, home, "spread", Strategies(server, every=True)))


@pytest.mark.parametrize(
    ("twist", "fails"),
    [
        ("Twist(200.0, 0.0)", False),
        ('Twist(float("nan") if self.count % 5 == 0 else 0.4, 0.0)', False),
        ('Twist(0.4, float("inf"))', True),
    ],
)
def test_a_motion_is_judged_alike_wherever_a_strategy_decides(
    home: Path, server: ForkServer, twist: str, fails: bool
) -> None:
    (home / "odd.py").write_text(DRIVES.replace("TWIST", twist))
    ways = {"alone": None, "spread": Strategies(server, every=True, deadline=60.0)}
    ways |= {"sealed": Strategies(server, strangers=True, deadline=60.0)} if missing() is None else {}
    played = {way: play(home, way, apart) for way, apart in ways.items()}
    for folder, ending in played.values():
        same(folder, played["alone"][0])
        assert [failure.text for failure in ending.failures] == [
            failure.text for failure in played["alone"][1].failures
        ]
        assert bool(ending.failures) == fails


@pytest.mark.parametrize("where", ["here", "apart"])
def test_who_has_spent_its_bank_of_time_forfeits_the_rest_in_a_repetition_too(
    home: Path, server: ForkServer, where: str
) -> None:
    (home / "tiny.toml").write_text(MATCH.replace('map = "open"', 'map = "open"\nbank = 0.5'))
    (home / "slower").touch()
    folder, ending = play(home, "spent", Strategies(server, every=True) if where == "apart" else None)
    [failure] = [failure for failure in ending.failures if failure.player == "ann"]
    assert "so that its bank of 0.5 s is spent: it forfeits its decisions" in failure.text
    assert ending.thinking["ann"] > 0.5
    found = [line for line in missed(folder) if line.player == "ann"]
    assert not any(line.asked or line.failure for line in found)
    assert len(found) > 30, "all until the end"
    same(folder, repeated(folder, home, "again", None))


def test_a_repetition_of_a_match_that_was_taken_up_spends_no_bank(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a slower computer its players take longer, and decide the same."""
    (home / "tiny.toml").write_text(MATCH.replace('map = "open"', 'map = "open"\nbank = 0.5'))
    of, _ = play(home, "recorded", None)
    change = Change(3.0, "shark", "sharks-and-minnows")
    branch = play_branch(of, [change], home / "branches", NOW, progress=lambda _: None, stop=Stop())  # type: ignore[arg-type]
    seconds = map(float, itertools.count())  # each look at this clock takes a second
    monkeypatch.setattr(in_process, "SteppedPlayer", partial(SteppedPlayer, clock=seconds.__next__))
    same(branch, repeated(branch, home, "again", None))


def test_a_process_that_is_killed_is_killed_in_a_repetition_too(home: Path, server: ForkServer) -> None:
    folder, ending = play(home, "killed", Strategies(server, every=True, deadline=60.0), Killer(4.0, signal.SIGKILL))
    (gone,) = missed(folder)
    assert (gone.player, gone.hung) == ("ann", False)
    assert "the process of the strategy is gone" in gone.failure
    assert len(ending.failures) == 1
    same(folder, repeated(folder, home, "again", None))
    same(folder, repeated(folder, home, "spread", Strategies(server, every=True)))


def test_a_frozen_process_is_given_up(home: Path, server: ForkServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "BUDGET", 0.5)
    folder, ending = play(home, "frozen", Strategies(server, every=True, deadline=0.2), Killer(4.0, signal.SIGSTOP))
    found = [line for line in missed(folder) if line.player == "ann"]
    assert found[0].asked
    assert found[-1].hung or ending.time < 10.0
    same(folder, repeated(folder, home, "again", None))


def test_a_repetition_of_a_repetition_is_the_same_where_a_strategy_hangs_each_time(
    home: Path, server: ForkServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(apart, "BUDGET", 1.5)  # a decision of another player must not last so long
    (home / "hangs").touch()
    of, _ = play(home, "hung", Strategies(server, every=True, deadline=0.1), Slow())
    assert any(line.hung for line in missed(of))
    for name in ("again", "once more"):
        repetition = repeat_match(of, home / name, NOW, Strategies(server, every=True), Stop())  # type: ignore[arg-type]
        same(of, repetition)
        of = repetition


class ByHand(ForkServer, Child):
    """A process of a strategy whose answers this test writes, and its server."""

    def __init__(self) -> None:
        self.stream, self.theirs = socket.socketpair()
        self.killed = False
        self.theirs.sendall(frame(Ready((), "{}")))

    def run(self, *_: object, **__: object) -> Child:
        return self

    def poll(self) -> int | None:
        return 0 if self.killed else None

    def send_signal(self, number: int) -> None:
        self.killed |= number != signal.SIGUSR1  # by which it writes where it is

    pid = 0


def seen(setup: MatchSetup, long: bytes = b"") -> View:
    robot, referee = setup.player("ann").robot, Match(rulebook_of(setup)).state(Observation({}), estop=False)
    readings, heard = Readings(1.0, 0.0, armed=True, estop=False), [TeamMessage("bob", 1.0, long)]
    return View(1.0, referee.players[0], readings, referee, {}, robot, Pose(0.0, 0.0, 0.0), heard)


def test_the_process_of_a_strategy_gets_no_seed_not_even_in_the_text_of_the_match(home: Path) -> None:
    setup, process = load_match(home / "tiny.toml"), ByHand()
    strategy = SubprocessStrategy(process, setup, "ann", RunFolder(home / "run"), sealed=False).made()
    size = int.from_bytes(process.theirs.recv(4), "big")
    sent = msgspec.json.decode(process.theirs.recv(size, socket.MSG_WAITALL))["setup"]
    strategy.close()
    assert (sent["name"], sent["seed"], sent.get("text")) == ("tiny", 0, None)


def test_a_process_that_reads_nothing_holds_up_nothing_however_long_a_view_is(home: Path) -> None:
    setup, now, written, process = load_match(home / "tiny.toml"), [0.0], list[Line](), ByHand()
    options: Any = {"sealed": False, "deadline": 0.0, "write": written.append, "now": lambda: now[0]}
    strategy = SubprocessStrategy(process, setup, "ann", RunFolder(home / "run"), **options).made()
    view = seen(setup, bytes(5_000_000))
    for now[0] in (0.0, BUDGET):
        strategy.send(view)
        with pytest.raises(ForfeitError):
            strategy.act(view)
    now[0] += 0.1
    with pytest.raises(DecisionTimeoutError, match="a decision may take 5 s"):
        strategy.act(view)
    assert process.killed
    assert [(line.asked, line.hung) for line in written if isinstance(line, Missed)] == [
        (True, False), (False, False), (False, True)
    ]  # fmt: skip


def test_one_that_begins_to_answer_and_does_not_end_forfeits_the_step(home: Path) -> None:
    setup, process = load_match(home / "tiny.toml"), ByHand()
    strategy = SubprocessStrategy(process, setup, "ann", RunFolder(home / "run"), sealed=False, deadline=0.0).made()
    strategy.send(view := seen(setup))
    process.theirs.sendall(b"\0\0")
    with pytest.raises(ForfeitError):
        strategy.act(view)
    assert not process.killed
    strategy.close()


def test_what_comes_too_late_is_forgotten_but_for_a_failure(home: Path) -> None:
    setup, written, process = load_match(home / "tiny.toml"), list[Line](), ByHand()
    options: Any = {"sealed": False, "deadline": 0.0, "write": written.append}
    strategy = SubprocessStrategy(process, setup, "ann", RunFolder(home / "run"), **options).made()
    view = seen(setup)
    for late in (Decision((0.1, 0.0, 0.0, 0.0), Payload(), "-"), Failed("it is out of fuel", final=True)):
        strategy.send(view)
        with pytest.raises(ForfeitError):
            strategy.act(view)
        process.theirs.sendall(frame(late))
    strategy.send(view)
    with pytest.raises(StrategyError, match="out of fuel"):
        strategy.act(view)
    lines = [line for line in written if isinstance(line, Missed)]
    assert [(line.asked, line.failure, line.final) for line in lines] == [
        (True, "", False), (True, "", False), (False, "it is out of fuel", True)
    ]  # fmt: skip
    assert process.killed


@pytest.mark.parametrize("in_player", [True, False])
def test_where_it_is_not_asked_only_its_players_process_finds_that_it_hangs_or_has_ended(
    home: Path, caplog: pytest.LogCaptureFixture, in_player: bool
) -> None:
    setup, now = load_match(home / "tiny.toml"), [0.0]
    options: Any = {"sealed": False, "deadline": 0.0, "now": lambda: now[0], "in_player": in_player}
    (home / "run" / "logs").mkdir(parents=True, exist_ok=True)
    hanging, ended = (
        SubprocessStrategy(ByHand(), setup, "ann", RunFolder(home / "run"), **options).made() for _ in range(2)
    )
    hanging.send(seen(setup))
    with pytest.raises(ForfeitError):
        hanging.act(seen(setup))
    assert hanging.forfeited == 1
    assert "forfeited, 1 so far" in caplog.text
    assert ("ann: a decision" in caplog.text) != in_player
    hanging.check()
    now[0] = BUDGET + 0.1
    ended._process.theirs.close()  # type: ignore[attr-defined]
    if in_player:
        with pytest.raises(DecisionTimeoutError, match="a decision may take 5 s"):
            hanging.check()
        with pytest.raises(StrategyError, match="is gone: it has ended"):
            ended.check()
    else:
        hanging.check()
        ended.check()
        hanging.close()
        ended.close()


def test_one_that_answers_what_it_has_not_read_is_ended(home: Path) -> None:
    setup, process = load_match(home / "tiny.toml"), ByHand()
    strategy = SubprocessStrategy(process, setup, "ann", RunFolder(home / "run"), sealed=False).made()
    view = seen(setup, bytes(5_000_000))
    process.theirs.sendall(frame(Decision((0.1, 0.0, 0.0, 0.0), Payload(), "-")))
    strategy.send(view)
    assert strategy.act(view).twist.v == 0.1
    strategy.send(view)
    with pytest.raises(StrategyError, match="is gone: it answers questions that it has not read"):
        strategy.act(view)
    assert process.killed


@pytest.mark.parametrize(
    ("printed", "told"),
    [
        ("echo 'Permission denied (publickey).' >&2; exit 255", "lab2: .*: put your key there with `ssh-copy-id"),
        ("exec yes welcome", r"lab2: it has ended with status -\d+: welcome"),
    ],
    ids=["refused", "greets for ever"],
)
def test_a_machine_that_cannot_be_used_is_named_with_what_it_has_printed(
    home: Path, monkeypatch: pytest.MonkeyPatch, printed: str, told: str
) -> None:
    (home / "ssh").write_text(f"#!/bin/sh\n{printed}\n")
    (home / "ssh").chmod(0o700)
    monkeypatch.setenv("VRG_SSH", str(home / "ssh"))
    placed = MATCH.replace('name = "ann"', 'name = "ann"\nmachine = "lab2"')
    (home / "tiny.toml").write_text(f'{placed}[machines.lab2]\nhost = "lab2"\n')
    setup = load_match(home / "tiny.toml")
    with pytest.raises(LaunchError, match=told):
        SubprocessStrategy(ForkServer(), setup, "ann", RunFolder(home / "run"), sealed=False, machine="lab2").made()


def test_what_a_strategy_raises_is_the_same_in_its_own_process(home: Path, server: ForkServer) -> None:
    (home / "raises").touch()
    alone, ending = play(home, "alone", None)
    spread, other = play(home, "spread", Strategies(server, every=True, deadline=60.0))
    assert alone.journal.read_bytes() == spread.journal.read_bytes()
    assert ending.failures == other.failures
    assert "RuntimeError: twenty" in ending.failures[0].text
    same(spread, repeated(spread, home, "again", None))


def test_one_that_cannot_be_made_again_is_out_in_a_repetition_too(home: Path, server: ForkServer) -> None:
    (home / "once").touch()
    folder, ending = play(home, "unmade", Strategies(server, every=True, deadline=60.0))
    (line,) = [line for line in read_steps(folder.steps) if isinstance(line, Unmade)]
    assert "it cannot be imported any more" in line.why
    assert next(player for player in ending.state.players if player.name == "ann").state == "disqualified"
    same(folder, repeated(folder, home, "again", None))


def test_a_match_that_was_given_up_is_given_up_again(home: Path, server: ForkServer) -> None:
    (home / "tiny.toml").write_text(MATCH.replace('map = "open"', 'map = "open"\non_fault = "halt"'))
    (home / "raises").touch()
    command = ["play", "tiny.toml", "--lockstep", "--headless", "--no-sandbox", "--deadline", "4", "--runs", "first"]
    assert invoke(*command).exit_code == 1
    first = RunFolder(next((home / "first").glob("tiny-*")))
    assert "given up" in first.result.read_text()
    again = repeat_match(first, home / "again", NOW, None, Stop())  # type: ignore[arg-type]
    assert first.journal.read_bytes() == again.journal.read_bytes()
    assert "given up" in again.result.read_text()


class Counting(Strategy):
    """A strategy that counts how often it is asked."""

    asked = 0

    def act(self, view: View) -> Twist:
        self.asked += 1
        return Twist(0.1 * self.asked, 0.0)


def test_a_strategy_is_asked_where_it_was() -> None:
    strategy = Counting("ann", robot_model("P2AT"))
    past = {0.2: Missed(time=0.2, player="ann", asked=True), 0.3: Missed(time=0.3, player="ann", asked=False)}
    written: list[Missed] = []
    again = StrategyHere(strategy, past, written.append)
    motions = []
    for now in (0.1, 0.2, 0.3, 0.4):
        view: Any = SimpleNamespace(time=now, me=SimpleNamespace(may_move=True, lease=None))
        try:
            motions.append(again.act(view).twist.v)
        except ForfeitError:
            motions.append(None)
    assert motions == [0.1, None, None, pytest.approx(0.3)]
    assert strategy.asked == 3
    assert written == list(past.values())


def test_one_that_keeps_too_much_is_ended_while_it_plays(
    home: Path, server: ForkServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(apart, "BUDGET", 60.0)
    setup, folder = load_match(home / "tiny.toml"), RunFolder(home / "run")
    strategy = SubprocessStrategy(server, setup, "ann", folder, sealed=True).made()
    (folder.of_player("ann") / "much").write_bytes(bytes(150_000_000))
    # It is asked for nothing, so it does not answer: it is waited for until it is ended.
    with pytest.raises(StrategyError, match=r"it keeps 1\d\d MB in \d files in its folder"):
        strategy.act(seen(setup))


def test_two_runs_are_compared_down_to_the_node_and_the_field(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.playing.match.plot", lambda *_: None)  # nobody looks at it here
    runs = []
    for name, speed in (("odd", "0.4"), ("other", "0.5")):
        (home / f"{name}.py").write_text(ODD.replace("HOME", str(home)).replace("0.4", speed))
        short = MATCH.replace("passes = 1", "passes = 1\npass_limit = 4.0")
        (home / "tiny.toml").write_text(short.replace("odd.py", f"{name}.py"))
        done = invoke("play", "tiny.toml", "--in-process", "--headless", "--runs", name)
        assert done.exit_code == 0, done.output
        runs.append(str(next((home / name).glob("tiny-*"))))
    same_run = invoke("run", "diff", runs[0], runs[0])
    assert (same_run.exit_code, "The same" in same_run.output) == (0, True)
    found = invoke("run", "diff", *runs)
    assert found.exit_code == 1
    assert "The match files differ" in found.output
    assert re.search(r"Recordings: at .* s, /player/ann/\w+, .*: .* there, .* here", found.output), found.output
    assert "Digests: the first that differ are those of" in found.output
    assert "Journals: the first lines that differ are" in found.output
    copy = shutil.copytree(runs[0], home / "copied" / "run")
    with (copy / "match.toml").open("a") as match:
        match.write("\n# a remark\n")
    remarked = invoke("run", "diff", runs[0], str(copy))
    assert remarked.exit_code == 0
    assert "The match files differ" in remarked.output
    assert "Nevertheless the same: the journals" in remarked.output
