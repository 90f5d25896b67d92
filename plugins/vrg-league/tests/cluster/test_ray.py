"""A cluster of Ray keeps the contract of what plays games; a fake stands in for Ray, unless it is installed."""

import contextlib
import io
import sys
import tarfile
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import fake_ray
import psutil
import pytest
import test_workers
from experiments import timeless
from hypothesis import given
from hypothesis import strategies as st
from test_workers import *  # noqa: F403 - the contract
from test_workers import game_of, play_one

from vrg.errors import LaunchError
from vrg_league.experiment import code_of_vrg
from vrg_league.games import FAILED, OVER, Played, ScheduledGame
from vrg_league.ray import LOCAL, GameTask, RayWorkers, _connected, archive_of, play, unpack
from vrg_league.running import Experiment
from vrg_league.workers import Workers

WITH_RAY = pytest.mark.skipif(
    find_spec("ray") is None, reason="ray is not installed: pip install 'virtual-robotic-games-league[ray]'"
)
FAKE = pytest.param("fake ray", marks=pytest.mark.thorough)
"""A worker of the fake loads VRG anew for each of its tasks."""
RAY = pytest.param("ray", marks=WITH_RAY)


class Bench(test_workers.Bench):
    """A folder of an experiment, and a cluster that plays its games."""

    def made(self, kind: str, experiment: Experiment, jobs: int) -> Workers:
        """See the base class."""
        if kind == "processes":
            return super().made(kind, experiment, jobs)
        if kind == "fake ray":
            patch = self.stack.enter_context(pytest.MonkeyPatch.context())
            patch.setitem(sys.modules, "ray", fake_ray)
            patch.setattr(RayWorkers, "require", lambda: None)
        return RayWorkers(LOCAL, jobs, jobs, experiment.folder)


@pytest.fixture
def bench(match: Path) -> Iterator[Bench]:
    with ExitStack() as stack:
        yield Bench(match, stack)


@pytest.fixture(params=[FAKE, RAY])
def kind(request: pytest.FixtureRequest) -> str:
    """The kind of cluster."""
    return request.param


class Killer:
    """Kills workers of a cluster while games are played; one of Ray's is found by its process.

    It is a stop signal that is never set, as an experiment asks one between two looks at its games. A worker may just
    have ended its game when it is killed, so others are killed until a game had to be played again.
    """

    def __init__(self, workers: RayWorkers) -> None:
        self.submitted: list[GameTask] = []
        start = workers._play.remote

        def counted(task: GameTask, files: object) -> object:
            self.submitted.append(task)
            return start(task, files)

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
    monkeypatch.setattr("vrg_league.ray.code_of_vrg", lambda: "other")
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
    monkeypatch.setattr("vrg.packages.find_spec", lambda _: None)
    with pytest.raises(
        LaunchError, match=r"--ray: .* pip install 'virtual-robotic-games-league\[ray\]', here and on every computer"
    ):
        RayWorkers.require()


@WITH_RAY
def test_a_cluster_that_is_not_there_is_told() -> None:
    for address in ("127.0.0.1:1", "ray://127.0.0.1:1", "nonsense"):
        with pytest.raises(LaunchError, match=f"--ray {address}: expected local, auto, or the host and port"):
            _connected(address, 1)
