"""The supervisor of one machine, with players that are programs of a few lines."""

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

from vrg.bus.topics import Keys
from vrg.errors import LaunchError
from vrg.launch import greed, managed
from vrg.launch.process import Process
from vrg.launch.supervisor import Supervisor
from vrg.testing.waiting import wait_until

PLAYER = """
import json, os, signal, subprocess, sys, time

from vrg.launch import ending

kind = json.loads(sys.argv[-1])["strategy"]
signal.signal(signal.SIGUSR1, signal.SIG_IGN)
if kind == "stubborn":
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
if kind == "parent":
    # What it starts needs the memory.
    code = "held = bytearray(200_000_000); import time; time.sleep(3600)"
    subprocess.Popen([sys.executable, "-c", code])
if "exits" in kind:
    os._exit(int(kind[-1]))
print("started", flush=True)
if kind == "broken":
    print("vrg: this is not believed: it stands in the log", file=sys.stderr, flush=True)
    try:
        raise ValueError(f"no goal {time.time()}")
    except ValueError as error:
        ending.tell(error, str(error), name="")
    sys.exit(1)
time.sleep(3600.0)
"""
Make = Callable[..., Supervisor]


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Make]:
    (tmp_path / "players.py").write_text(PLAYER, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.getcwd()}")
    monkeypatch.setattr(managed, "process_main", SimpleNamespace(__name__="players"))
    made: list[Supervisor] = []

    def supervisor(*kinds: str, memory: int = 2000) -> Supervisor:
        specs = [
            Process(name=f"p{number}", kind="player", run=str(tmp_path), strategy=kind, says="started")
            for number, kind in enumerate(kinds)
        ]
        made.append(Supervisor(specs, "tcp/h:1", Keys("match"), tmp_path, lambda _: None, memory=memory))
        made[0].begin(1)
        while made[0].starting:
            made[0].started()
        return made[0]

    yield supervisor
    for supervised in made:
        supervised.close()


def polled(supervisor: Supervisor) -> dict[str, str]:
    supervisor.poll()
    return supervisor.take_failed()


def out(supervisor: Supervisor) -> dict[str, str]:
    """The players that have failed, as soon as one has."""
    failed: dict[str, str] = {}
    wait_until(lambda: failed.update(polled(supervisor)) or failed, "the player to be out")
    return failed


def test_who_fails_by_the_same_error_for_the_third_time_ends_the_match_and_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "players.py").write_text(PLAYER, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.getcwd()}")
    monkeypatch.setattr(managed, "process_main", SimpleNamespace(__name__="players"))
    spec = Process(name="referee", kind="coordinator", run=str(tmp_path), strategy="broken", says="started")
    said = list[str]()
    supervisor = Supervisor([spec], "tcp/h:1", Keys("match"), tmp_path, said.append)
    try:
        supervisor.begin(1)

        def given_up() -> bool:
            try:
                supervisor.poll()
            except LaunchError as error:
                said.append(str(error))
                return True
            return False

        wait_until(given_up, "the match to be given up")
    finally:
        supervisor.close()
    assert len(said) == 3
    assert all(text.startswith("referee: ") and "no goal" in text and "started again" in text for text in said[:2])
    assert "too often to continue" in said[2]


def test_nothing_waits_for_greedy_players_that_ignore_a_stop(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor = make("stubborn", "stubborn", "modest")
    greedy = supervisor.processes[:2]
    pids = {process.pid for process in greedy}
    monkeypatch.setattr(greed, "_memory", lambda used: {pid: 1e12 * (pid in pids) for pid in used})
    failed: dict[str, str] = {}
    while len(failed) < 2:
        failed |= polled(supervisor)
    assert failed == dict.fromkeys(("p0", "p1"), "it uses more than 2000 MB of memory")
    assert all(process.pid is not None for process in greedy), "they may still stop their robots"
    while any(process.pid is not None for process in greedy):
        supervisor.poll()
    assert [process.exit_status for process in greedy] == [-9, -9], "they were killed"
    assert supervisor.processes[2].pid is not None


def test_a_player_whose_end_is_not_seen_holds_up_nothing(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that waits for a device ends only when the device lets it, whatever it is sent."""
    supervisor = make("modest", "modest")
    stuck, other = supervisor.processes
    monkeypatch.setattr(stuck, "kill", lambda: None)
    monkeypatch.setattr(stuck, "terminate", lambda: None)
    monkeypatch.setattr(managed, "KILLED", 0.1)
    monkeypatch.setattr("vrg.launch.supervisor.HANDOVER", 0.0)
    monkeypatch.setattr("vrg.launch.supervisor.STOP_TIMEOUT", 0.1)
    supervisor.play("p0", "other")
    other.kill()
    wait_until(lambda: other.exit_status is not None, "the other to end")
    died = other.exit_status
    wait_until(lambda: polled(supervisor) == {} and other.pid is not None, "the other to be started again")
    assert (died, other.status("here").restarts) == (-9, 1)
    assert stuck.pid is not None
    monkeypatch.undo()


@pytest.mark.parametrize("kind", ["exits 0", "exits 1", "exits 7"])
def test_a_player_that_ends_its_program_before_it_is_ready_is_out_and_the_others_play(make: Make, kind: str) -> None:
    supervisor = make("modest", kind)
    assert supervisor.take_failed() == {"p1": f"ended with status {kind[-1]}"}
    assert supervisor.processes[0].pid is not None


def test_a_player_that_cannot_be_started_again_is_out_alone(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor = make("modest", "modest")
    first = supervisor.processes[0]
    monkeypatch.setattr(first.log, "path", Path("/dev/null/log"))
    first.kill()
    failed = out(supervisor)
    assert list(failed) == ["p0"]
    assert "cannot be started: [Errno 20]" in failed["p0"]
    assert supervisor.processes[1].pid is not None


def test_what_a_player_starts_counts_as_its_memory(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    if sys.platform != "linux":
        pytest.skip("the memory of a process is told otherwise elsewhere")
    supervisor = make("parent", "modest", memory=100)
    own = supervisor.processes[0].pid
    assert own is not None
    (started,) = psutil.Process(own).children()
    monkeypatch.setattr(greed, "_OWN", 0)
    assert out(supervisor) == {"p0": "it uses more than 100 MB of memory"}
    wait_until(lambda: polled(supervisor) == {} and not started.is_running(), "what it has started to be ended")


def test_a_process_that_is_listed_as_its_own_parent_is_looked_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """As process 0 of macOS and Windows."""
    listed = [SimpleNamespace(pid=pid, ppid=lambda parent=parent: parent) for pid, parent in ((0, 0), (2, 3), (3, 2))]
    monkeypatch.setattr(greed.psutil, "process_iter", lambda: listed)
    assert greed._memory([7]) == {7: 0}
