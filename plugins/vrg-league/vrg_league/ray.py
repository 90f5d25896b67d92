"""Games on a cluster of Ray (https://www.ray.io).

A task of Ray calls `play` in a worker of Ray's, and this plays the game in its own process below the worker, as on
this computer: a strategy that ends its process, or hangs, does not harm the worker. Ray itself does not repeat tasks,
so that the games that were played again are counted in one place.
"""

import functools
import io
import logging
import os
import signal
import socket
import tarfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from msgspec import Struct

from vrg.bus.stopping import StopSignal
from vrg.config.loading import load_match
from vrg.config.setup import CheckedMatch
from vrg.errors import LaunchError
from vrg.packages import Package, lacking
from vrg.runs.run_folder import RunFolder, delete, scratch_folder
from vrg.system import in_main_thread
from vrg_league.experiment import code_of_vrg
from vrg_league.folder import ExperimentFolder
from vrg_league.game_process import GameProcess, ended, server_for
from vrg_league.games import FAILED, Played, ScheduledGame
from vrg_league.workers import Workers

log = logging.getLogger(__name__)

LOCAL = "local"
"""The address that starts a cluster on this computer."""
DEATHS = 3
"""The number of workers that may die of one game. A strategy may be what kills them."""
_PROBE = 3.0
"""The real time in s for a cluster to accept a connection."""
_LOOK = 0.2
"""The real time in s between two moments in which a game can be ended."""
_STORE = 200_000_000
"""The memory in bytes for what the games of a local cluster share: matches and logs."""


class GameTask(Struct, frozen=True, kw_only=True):
    """A game to be played.

    Args:
        name: the name of the game's folder. seed: the seed of the match.
        limit: the match time in s after which it is broken off.
        code: the SHA-256 of the code of VRG that the worker must have.
    """

    name: str
    seed: int
    limit: float
    code: str


class Answer(Struct, frozen=True, kw_only=True):
    """The answer of a worker: the result of the game, and the files of a game that has failed."""

    played: Played
    logs: bytes = b""


@dataclass(frozen=True)
class _Running:
    game: ScheduledGame
    task: GameTask
    match: Any
    handle: Any
    deaths: int = 0


class RayWorkers(Workers):
    """Plays games on a cluster of Ray; see `Workers`.

    Args:
        address: of a cluster that runs, such as `auto` or `192.168.1.5:6379`; LOCAL starts one that ends with this.
        jobs: the number of games at a time; None for as many as the cluster can play. cores: those of a local cluster.

    Raises:
        LaunchError: Ray is not installed, or the cluster cannot be reached.
    """

    def __init__(self, address: str, jobs: int | None, cores: int, folder: ExperimentFolder) -> None:
        self._ray = _connected(address, jobs or cores)
        self._play = self._ray.remote(num_cpus=1, max_retries=0)(play)
        self.jobs = jobs or max(1, int(self._ray.cluster_resources().get("CPU", 1)))
        self._folder = folder
        self._matches: dict[Path, Any] = {}
        self._code = code_of_vrg()
        self._played: list[_Running] = []

    @classmethod
    def at(cls, address: str, jobs: int | None, cores: int, folder: ExperimentFolder) -> "RayWorkers":
        """See `Workers.at`."""
        return cls(address, jobs, cores, folder)

    @staticmethod
    def require() -> None:
        """Check that Ray is installed, without loading it.

        Raises:
            LaunchError: it is not.
        """
        if why := lacking("ray", Package("virtual-robotic-games-league[ray]", ("ray",))):
            raise LaunchError(
                f"--ray: {why}, here and on every computer of the cluster; or leave out --ray to play on this computer"
            )

    def games(self) -> list[ScheduledGame]:
        """The games that are being played."""
        return [running.game for running in self._played]

    def minute(self, setup: CheckedMatch, stop: StopSignal) -> None:
        """See `Workers.minute`: how fast the computers of a cluster are, its first games show."""

    def start(self, game: ScheduledGame, setup: CheckedMatch, limit: float) -> None:
        """Start a game; see `Workers.start`. The worker reads its match from the match file, which travels there."""
        source = self._folder.match_file(game).parent
        if source not in self._matches:
            self._matches[source] = self._ray.put(archive_of(source))
        task = GameTask(name=self._folder.name_of(game), seed=game.seed, limit=limit, code=self._code)
        match = self._matches[source]
        self._played.append(_Running(game, task, match, self._play.remote(task, match)))

    def finished(self, timeout: float) -> Iterator[tuple[ScheduledGame, Played]]:
        """Wait at most `timeout` seconds for a game to end, and take away all games that have ended.

        Raises:
            LaunchError: no game can be played any more.
        """
        handles = [running.handle for running in self._played]
        ready = set(self._ray.wait(handles, num_returns=len(handles), timeout=timeout)[0]) if handles else set()
        for running in [r for r in self._played if r.handle in ready]:
            answer = self._answer(running)
            if answer is None:
                again = replace(running, handle=self._play.remote(running.task, running.match))
                self._played[self._played.index(running)] = replace(again, deaths=running.deaths + 1)
                continue
            self._played.remove(running)
            if answer.logs:
                target = self._folder.failures / running.task.name
                delete(target)
                try:
                    unpack(answer.logs, target)
                except LaunchError as error:
                    log.warning("%s: its logs are lost: %s", running.task.name, error)
            yield running.game, answer.played

    def _answer(self, running: _Running) -> Answer | None:
        """The answer of a game that has ended; None if its worker has died, and it is to be played again.

        Raises:
            LaunchError: no game can be played, for example because the cluster cannot be reached.
        """
        errors = self._ray.exceptions
        died = errors.WorkerCrashedError, errors.NodeDiedError, errors.OutOfMemoryError, errors.ObjectLostError
        try:
            answer: Answer = self._ray.get(running.handle)
        except errors.RayTaskError as error:
            raise LaunchError(f"a game cannot be played on the cluster: {_brief(error.cause)}") from None
        except died as error:
            if running.deaths + 1 < DEATHS:
                return None
            why = f"{DEATHS} workers of the cluster have died of it: {_brief(error)}"
            return Answer(played=Played(ended=FAILED, problem=why))
        except errors.RayError as error:
            raise LaunchError(f"the cluster has failed: {_brief(error)}: the same command continues") from None
        return answer

    def cancel(self, game: ScheduledGame) -> None:
        """End a game that is being played."""
        for running in [r for r in self._played if r.game == game]:
            self._played.remove(running)
            self._ray.cancel(running.handle, force=False)

    def close(self) -> None:
        """End all games that are being played, and leave the cluster; a local one ends. Idempotent."""
        for game in self.games():
            self.cancel(game)
        self._ray.shutdown()


def _connected(address: str, cores: int) -> Any:
    """Ray, connected to a cluster.

    Raises:
        LaunchError: Ray is not installed, or the cluster cannot be reached.
    """
    RayWorkers.require()
    # By default Ray reports to its makers how it is used.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if address == LOCAL:
        # By default Ray's workers give way to every other program of this computer.
        os.environ.setdefault("RAY_worker_niceness", "0")
    import ray  # noqa: PLC0415 - only who asks for a cluster loads it

    local = {"num_cpus": cores, "include_dashboard": False, "object_store_memory": _STORE}
    options = local if address == LOCAL else {"address": address}
    if address not in (LOCAL, "auto"):
        _check_reachable(address)
    main = in_main_thread()
    before = signal.getsignal(signal.SIGTERM) if main else None
    try:
        ray.init(log_to_driver=False, logging_level=logging.ERROR, **options)
    except (ConnectionError, ValueError, RuntimeError, OSError) as error:
        raise LaunchError(
            f"--ray {address}: the cluster cannot be used: {_brief(error)}: is it one of the same release of Ray, "
            "and if it asks for a token, does this computer have it?"
        ) from None
    finally:
        if before is not None:
            # Ray's own handler would end this process before it has printed the results so far.
            signal.signal(signal.SIGTERM, before)
    return ray


def _check_reachable(address: str) -> None:
    """Check that something listens at an address. Ray itself would try for minutes.

    Raises:
        LaunchError: the address cannot be read, or nothing listens there.
    """
    host, _, port = address.removeprefix("ray://").rpartition(":")
    try:
        socket.create_connection((host, int(port)), timeout=_PROBE).close()
    except (OSError, ValueError) as error:
        raise LaunchError(
            f"--ray {address}: expected local, auto, or the host and port of a cluster that runs, such as "
            f"192.168.1.5:6379: {error}"
        ) from None


def _brief(error: BaseException) -> str:
    """The first line of an error's text."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


def play(task: GameTask, match: bytes) -> Answer:
    """Play a game on this computer, and leave nothing behind. An exception that comes meanwhile ends the game.

    Args:
        match: the folder with its match file, packed.

    Raises:
        LaunchError: this computer has another release of VRG, or cannot write files.
        ConfigError: the match cannot be loaded here, for example because a package is missing.
    """
    if task.code != _own_code():
        raise LaunchError("a worker of the cluster has another release of VRG: install this one on every computer")
    with scratch_folder() as place:
        base, folder = place / "match", place / task.name
        unpack(match, base)
        setup = load_match(RunFolder(base).match_file)
        game = GameProcess(_server(setup.game, setup.engine), setup, task.seed, folder, task.limit)
        with ExitStack() as stack:
            stack.callback(game.kill)
            while not (found := ended([game], _LOOK)):
                pass
        [(_, result)] = found
        failed = result.failures or result.problem
        return Answer(played=result, logs=archive_of(folder) if failed and folder.exists() else b"")


_own_code = functools.cache(code_of_vrg)
_server = functools.cache(server_for)
"""A server of processes is made once, as it loads what they need."""


def archive_of(folder: Path) -> bytes:
    """All files in a folder and below it, but no links.

    Raises:
        LaunchError: one cannot be read.
    """
    content = io.BytesIO()
    try:
        with tarfile.open(fileobj=content, mode="w:gz") as tar:
            found = (Path(place, name) for place, _, names in os.walk(folder) for name in names)
            for file in sorted(path for path in found if path.is_file() and not path.is_symlink()):
                tar.add(file, file.relative_to(folder).as_posix(), recursive=False)
    except OSError as error:
        raise LaunchError(f"{folder}: cannot be sent: {error.strerror}") from None
    return content.getvalue()


def unpack(content: bytes, folder: Path) -> None:
    """Write the files of a folder that was packed. Nothing is written outside the folder.

    Raises:
        LaunchError: these are no packed files, or they cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:gz") as tar:
            tar.extractall(folder, filter="data")
    except (OSError, tarfile.TarError, EOFError) as error:
        raise LaunchError(f"{folder}: expected packed files: {error}") from None
