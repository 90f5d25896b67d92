"""What plays games keeps one contract, whether it is processes of this computer or something else."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
from experiments import alive, experiment, unsealed

from vrg.config.loading import load_match
from vrg.config.setup import MatchSetup
from vrg.testing.waiting import wait_until
from vrg_league.games import FAILED, OVER, Played, ScheduledGame
from vrg_league.running import Experiment
from vrg_league.workers import Workers

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


class Bench:
    """A folder of an experiment of two strategies, and a backend that plays its games."""

    def __init__(self, match: Path, stack: ExitStack) -> None:
        self.match = match
        # What a strategy does to the process of its game is looked at here, so it must be in it.
        unsealed(match)
        self.marker = match.with_name("asleep")
        players = match.parent / "players.py"
        players.write_text(players.read_text() + MORE_PLAYERS.format(marker=self.marker), encoding="utf-8")
        self.stack = stack

    def experiment(self, first: str, second: str, out: str = "out", pairs: int = 1) -> Experiment:
        """An experiment in a folder of its own."""
        return self.stack.enter_context(experiment(self.match, first, second, out, pairs=pairs, seed=3))

    def workers(self, kind: str, experiment: Experiment, jobs: int = 2) -> Workers:
        """What plays the games of an experiment."""
        return self.stack.enter_context(self.made(kind, experiment, jobs))

    def made(self, kind: str, experiment: Experiment, jobs: int) -> Workers:
        """What plays games, before it is entered; a package that plays them elsewhere has other kinds."""
        assert kind == "processes"
        return Workers(jobs, experiment.folder, experiment.setup)


@pytest.fixture
def kind() -> str:
    """The kind of what plays games. A package that plays them elsewhere replaces it and `bench`."""
    return "processes"


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


def test_what_has_failed_is_kept_with_its_traceback(bench: Bench, kind: str) -> None:
    experiment = bench.experiment("Raises", "Ahead")
    found = play_one(bench.workers(kind, experiment), experiment, 0)
    assert any("ValueError: no idea" in failure for failure in found.failures)
    log = experiment.folder.failures / "Raises.vs.Ahead-0" / "logs" / "shark.log"
    assert 'raise ValueError("no idea")' in log.read_text()


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
    if kind != "ray":
        assert not list(own.glob("vrg-*"))
