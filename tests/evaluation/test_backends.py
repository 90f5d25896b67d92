"""What plays games keeps one contract, whether it is processes of this computer or a cluster of Ray."""

import contextlib
import importlib.util
import io
import os
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.evaluation import fake_ray
from tests.evaluation.conftest import WITH_RAY, alive, experiment, timeless, unsealed
from tests.system.harness import wait_until
from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.evaluation.experiment import code_of_vrg
from vrg.evaluation.games import FAILED, OVER, Played, ScheduledGame
from vrg.evaluation.ray_workers import LOCAL, GameTask, RayWorkers, _connected, archive_of, play, require_ray, unpack
from vrg.evaluation.running import Experiment
from vrg.evaluation.workers import Workers

PATIENCE = 120.0
"""The real time in s that something may take to happen."""
MORE_PLAYERS = """

import time


class Sleeps(Strategy):
    def act(self, view):
        from pathlib import Path

        Path("{marker}").touch()
        signal.pthread_sigmask(signal.SIG_BLOCK, set(signal.Signals) - {{signal.SIGKILL}})
        time.sleep(1000.0)
        return STILL


class KillsParent(Strategy):
    def act(self, view):
        os.kill(os.getppid(), signal.SIGKILL)
        return STILL
"""
FAKE = pytest.param("fake ray", marks=pytest.mark.thorough)
"""A worker of the fake loads VRG anew for each of its tasks. One test of each way to end a task is in brief."""
RAY = pytest.param("ray", marks=WITH_RAY)
KINDS = ["processes", FAKE, RAY]


class Bench:
    """A folder of an experiment of two strategies, and a backend that plays its games."""

    def __init__(self, match: Path, stack: ExitStack) -> None:
        self.match = match
        # What a strategy does to the process of its game is looked at here, so it must be in it.
        unsealed(match)
        self.marker = match.with_name("asleep")
        players = match.parent / "players.py"
        players.write_text(players.read_text() + MORE_PLAYERS.format(marker=self.marker), encoding="utf-8")
        self._stack = stack

    def experiment(self, first: str, second: str, out: str = "out", pairs: int = 1) -> Experiment:
        """An experiment in a folder of its own."""
        return self._stack.enter_context(experiment(self.match, first, second, out, pairs=pairs, seed=3))

    def workers(self, kind: str, experiment: Experiment, jobs: int = 2) -> Workers:
        """What plays the games of an experiment."""
        if kind == "processes":
            workers = Workers(jobs, experiment.folder, experiment.setup)
        else:
            if kind == "fake ray":
                patch = self._stack.enter_context(pytest.MonkeyPatch.context())
                patch.setitem(sys.modules, "ray", fake_ray)
                patch.setattr("vrg.evaluation.ray_workers.require_ray", lambda: None)
            workers = RayWorkers(LOCAL, jobs, jobs, experiment.folder)
        return self._stack.enter_context(workers)


@pytest.fixture
def bench(match: Path) -> Iterator[Bench]:
    with ExitStack() as stack:
        yield Bench(match, stack)


def game_of(experiment: Experiment, number: int) -> tuple[ScheduledGame, MatchSetup]:
    [pairing] = experiment.series
    game = experiment.folder.definition.game_of(pairing, number)
    return game, load_match(experiment.folder.match_file(game))


def play_one(backend: Workers, experiment: Experiment, number: int) -> Played:
    """Play one game to its end."""
    game, setup = game_of(experiment, number)
    backend.start(game, setup, 3600.0)
    return ended(backend)[0][1]


def ended(backend: Workers) -> list[tuple[ScheduledGame, Played]]:
    """Wait for games to end."""
    found: list[tuple[ScheduledGame, Played]] = []
    deadline = time.monotonic() + PATIENCE
    while not found:
        assert time.monotonic() < deadline, "no game has ended"
        found += backend.finished(0.1)
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_game_is_counted_while_it_is_played_and_never_more_than_there_are_jobs(bench: Bench, kind: str) -> None:
    experiment = bench.experiment("sharks-and-minnows", "Ahead")
    backend = bench.workers(kind, experiment, jobs=2)
    assert (backend.free, backend.games()) == (2, [])
    games = [game_of(experiment, number) for number in (0, 1)]
    for game, setup in games:
        backend.start(game, setup, 3600.0)
    assert (backend.free, backend.games()) == (0, [game for game, _ in games])
    found = ended(backend)
    while len(found) < 2:
        found += ended(backend)
    assert sorted(game.number for game, _ in found) == [0, 1]
    assert (backend.free, backend.games()) == (2, [])
    assert list(backend.finished(0.0)) == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("deadly", [pytest.param("Dies", marks=pytest.mark.thorough), "KillsParent"])
def test_a_strategy_that_kills_takes_only_its_own_game_with_it(bench: Bench, kind: str, deadly: str) -> None:
    broken, good = bench.experiment(deadly, "Ahead", "broken"), bench.experiment("sharks-and-minnows", "Ahead", "good")
    backend = bench.workers(kind, broken, jobs=1)
    for number in (0, 1):
        found = play_one(backend, broken, number)
        if deadly == "Dies":
            assert (found.ended, "has ended with status 0" in found.problem) == (FAILED, True)
    backend.close()
    again = bench.workers(kind, good, jobs=1)
    assert play_one(again, good, 0).ended == OVER


@pytest.mark.parametrize("kind", KINDS)
def test_a_game_that_hangs_can_be_ended_and_the_next_one_is_played(bench: Bench, kind: str) -> None:
    hanging = bench.experiment("Sleeps", "Ahead", "hanging")
    backend = bench.workers(kind, hanging, jobs=1)
    game, setup = game_of(hanging, 0)
    backend.start(game, setup, 3600.0)
    wait_until(bench.marker.exists, "the strategy to sleep")
    stuck = [p for p in psutil.process_iter() if plays(p)]
    backend.cancel(game)
    backend.cancel(game)  # it is gone already
    assert not backend.games()
    good = bench.experiment("sharks-and-minnows", "Ahead", "good")
    wait_until(lambda: not alive(stuck), "its end")
    backend.close()
    backend = bench.workers(kind, good, jobs=1)
    assert play_one(backend, good, 0).ended == OVER


def plays(process: psutil.Process) -> bool:
    """Whether a process plays a game: its output goes into the log of one."""
    try:
        return os.readlink(f"/proc/{process.pid}/fd/1").endswith("process.log")
    except OSError:
        return False


@pytest.mark.parametrize("kind", KINDS)
def test_what_has_failed_is_kept_with_its_traceback(bench: Bench, kind: str) -> None:
    experiment = bench.experiment("Raises", "Ahead")
    found = play_one(bench.workers(kind, experiment), experiment, 0)
    assert any("ValueError: no idea" in failure for failure in found.failures)
    log = experiment.folder.failures / "Raises.vs.Ahead-0" / "logs" / "shark.log"
    assert 'raise ValueError("no idea")' in log.read_text()


@pytest.mark.parametrize("kind", ["processes", "fake ray", RAY])
def test_nothing_is_left_of_a_backend_that_was_closed(
    bench: Bench, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Other programs make folders in the usual place, too.
    own = tmp_path / "temporary"
    own.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(own))
    experiment = bench.experiment("Sleeps", "Ahead")
    backend = bench.workers(kind, experiment, jobs=1)
    backend.start(*game_of(experiment, 0), 3600.0)
    wait_until(bench.marker.exists, "the strategy to sleep")
    stuck = [p for p in psutil.process_iter() if plays(p)]
    assert stuck
    backend.close()
    backend.close()
    wait_until(lambda: not alive(stuck), "the game's end")
    assert not experiment.folder.playing.exists()
    if kind == "fake ray":
        assert not list(own.glob("vrg-*"))


class Killer:
    """Kills workers of a cluster while games are played; one of Ray's is found by its process.

    It is a stop signal that is never set, as an experiment asks one between two looks at its games. A worker may just
    have ended its game when it is killed, so others are killed until a game had to be played again.
    """

    def __init__(self, workers: RayWorkers) -> None:
        self.submitted: list[GameTask] = []
        start = workers._play.remote

        def counted(task: GameTask, match: object) -> object:
            self.submitted.append(task)
            return start(task, match)

        workers._play = SimpleNamespace(remote=counted)

    @property
    def again(self) -> list[str]:
        """The games that were submitted more than once."""
        names = [task.name for task in self.submitted]
        return sorted({name for name in names if names.count(name) > 1})

    def is_set(self) -> bool:
        if self.again:
            return False
        workers = [ref.process.pid for ref in fake_ray.started if ref.process.is_alive()]
        for process in psutil.Process().children(recursive=True):
            with contextlib.suppress(psutil.NoSuchProcess):
                if process.pid in workers or " ".join(process.cmdline()).startswith("ray::play"):
                    process.kill()
                    return False
        return False

    def wait(self, timeout: float) -> bool:
        return False


@pytest.mark.parametrize("kind", [FAKE, RAY])
def test_a_game_whose_worker_has_died_is_played_again_with_the_result_of_this_computer(bench: Bench, kind: str) -> None:
    here = bench.experiment("sharks-and-minnows", "Remembers", "here", pairs=2)
    here.run(bench.workers("processes", here), threading.Event(), lambda _: None)
    experiment = bench.experiment("sharks-and-minnows", "Remembers", kind, pairs=2)
    workers = bench.workers(kind, experiment, jobs=1)
    assert isinstance(workers, RayWorkers)
    killer = Killer(workers)
    experiment.run(workers, killer, lambda _: None)
    assert killer.again
    assert timeless(experiment.rows()) == timeless(here.rows())
    assert [row.played.ended for row in here.rows()] == [OVER] * 4


def test_a_game_of_which_too_many_workers_die_has_failed_and_the_next_one_is_played(bench: Bench) -> None:
    experiment = bench.experiment("sharks-and-minnows", "Ahead")
    with bench.workers("fake ray", experiment, jobs=1) as workers:
        workers.start(*game_of(experiment, 0), 3600.0)
        found: list[tuple[ScheduledGame, Played]] = []
        while not found:
            fake_ray.started[-1].process.kill()
            found += workers.finished(0.1)
        played = found[0][1]
        said = "3 workers of the cluster have died of it: the worker was killed"
        assert (played.ended, played.problem) == (FAILED, said)
        assert play_one(workers, experiment, 1).ended == OVER
    assert [ref.arguments[0].name[-1] for ref in fake_ray.started] == ["0", "0", "0", "1"]


def test_a_worker_with_another_release_is_told_and_nothing_is_counted(bench: Bench, monkeypatch) -> None:
    experiment = bench.experiment("sharks-and-minnows", "Ahead")
    monkeypatch.setattr("vrg.evaluation.ray_workers.code_of_vrg", lambda: "other")
    with pytest.raises(LaunchError, match="another release of VRG: install this one"):
        experiment.run(bench.workers("fake ray", experiment), threading.Event(), lambda _: None)
    assert experiment.rows() == []


def test_a_match_that_cannot_be_read_there_is_told(tmp_path: Path) -> None:
    task = GameTask(name="x", seed=0, limit=1.0, code=code_of_vrg())
    with pytest.raises(LaunchError, match="expected packed files"):
        play(task, b"nonsense")


@given(st.dictionaries(st.from_regex(r"[a-z]{1,8}(/[a-z]{1,8}){0,2}\.py", fullmatch=True), st.binary(max_size=200)))
def test_folders_travel_unchanged(files: dict[str, bytes]) -> None:
    with tempfile.TemporaryDirectory() as place:
        source, copy = Path(place, "source"), Path(place, "copy")
        source.mkdir()
        for name, content in files.items():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes(content)
        unpack(archive_of(source), copy)
        found = {p.relative_to(copy).as_posix(): p.read_bytes() for p in copy.rglob("*") if p.is_file()}
        assert found == files


def test_files_that_would_lie_outside_the_folder_are_refused(tmp_path: Path) -> None:
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w:gz") as tar:
        tar.addfile(tarfile.TarInfo("../outside.py"), io.BytesIO(b""))
    with pytest.raises(LaunchError, match="expected packed files"):
        unpack(content.getvalue(), tmp_path / "inside")
    assert not (tmp_path / "outside.py").exists()


def test_without_ray_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(LaunchError, match=r"pip install -e '\.\[cluster\]'"):
        require_ray()


def test_ray_is_not_loaded_without_the_option() -> None:
    code = "import sys, vrg.commands.compare, vrg.evaluation.running, vrg.evaluation.ray_workers"
    out = subprocess.run(
        [sys.executable, "-P", "-c", f"{code}\nprint('ray' in sys.modules)"], capture_output=True, text=True, check=True
    )
    assert out.stdout.strip() == "False"


@WITH_RAY
def test_a_cluster_that_is_not_there_is_told() -> None:
    for address in ("127.0.0.1:1", "ray://127.0.0.1:1", "nonsense"):
        with pytest.raises(LaunchError, match=f"--ray {address}: expected local, auto, or the host and port"):
            _connected(address, 1)
