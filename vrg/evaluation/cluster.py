"""Several games at a time on a cluster of computers. A game whose worker dies is played again."""

import logging
import shutil
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError, VrgError
from vrg.evaluation.backend import Backend
from vrg.evaluation.experiment import code_of_vrg
from vrg.evaluation.folder import ExperimentFolder
from vrg.evaluation.games import FAILED, Game, Played
from vrg.evaluation.parcel import packed, unpack
from vrg.evaluation.remote import Answer, Task

log = logging.getLogger(__name__)

DEATHS = 3
"""The number of workers that may die of one game. A strategy may be what kills them."""


class WorkerDiedError(VrgError):
    """The worker that played a game has died, or its computer has."""


class Cluster(ABC):
    """What a cluster must be able to do. Handles of games and of shared bytes are the cluster's own."""

    @abstractmethod
    def share(self, content: bytes) -> Any:
        """Bring bytes to where all workers find them, and return a handle for `submit`."""

    @abstractmethod
    def submit(self, task: Task, match: Any) -> Any:
        """Let some worker call `vrg.evaluation.remote.play`, and return a handle, which can be hashed."""

    @abstractmethod
    def ready(self, games: Sequence[Any], timeout: float) -> list[Any]:
        """Wait at most `timeout` seconds for a game to end, and return those that have."""

    @abstractmethod
    def answer(self, game: Any) -> Answer:
        """What came out of a game that is ready.

        Raises:
            WorkerDiedError: its worker has died. The game may be played again.
            LaunchError: no game can be played, for example because the cluster cannot be reached.
        """

    @abstractmethod
    def cancel(self, game: Any) -> None:
        """End a game. One that has ended is ignored."""

    @abstractmethod
    def close(self) -> None:
        """Leave the cluster. Idempotent."""


@dataclass(frozen=True)
class _Running:
    game: Game
    task: Task
    match: Any
    handle: Any
    deaths: int = 0


class ClusterWorkers(Backend):
    """See the module.

    Args:
        jobs: the number of games that are played at a time.
        folder: the folder of the experiment. The matches in it travel to the workers.
        cluster: where they are played. It is closed with this.
    """

    def __init__(self, jobs: int, folder: ExperimentFolder, cluster: Cluster) -> None:
        super().__init__(jobs)
        self._folder = folder
        self._cluster = cluster
        self._matches: dict[Path, Any] = {}
        self._running: list[_Running] = []
        self._code = code_of_vrg()

    def games(self) -> list[Game]:
        """The games that are being played."""
        return [running.game for running in self._running]

    def start(self, game: Game, setup: MatchSetup, limit: float) -> None:
        """Start a game; see `Backend.start`. The worker reads its match from the match file, which travels there."""
        source = self._folder.match_file(game).parent
        if source not in self._matches:
            self._matches[source] = self._cluster.share(packed(source))
        task = Task(name=self._folder.name_of(game), seed=game.seed, limit=limit, code=self._code)
        match = self._matches[source]
        self._running.append(_Running(game, task, match, self._cluster.submit(task, match)))

    def finished(self, timeout: float) -> Iterator[tuple[Game, Played]]:
        """Wait at most `timeout` seconds for a game to end, and take away all games that have ended.

        Raises:
            LaunchError: no game can be played any more.
        """
        ready = set(self._cluster.ready([running.handle for running in self._running], timeout))
        for running in [r for r in self._running if r.handle in ready]:
            try:
                answer = self._cluster.answer(running.handle)
            except WorkerDiedError as error:
                again = self._again(running)
                if again is not None:
                    self._running[self._running.index(running)] = again
                    continue
                why = f"{running.deaths + 1} workers of the cluster have died of it: {error}"
                answer = Answer(played=Played(ended=FAILED, problem=why))
            self._running.remove(running)
            if answer.logs:
                target = self._folder.failures / running.task.name
                shutil.rmtree(target, ignore_errors=True)
                try:
                    unpack(answer.logs, target)
                except LaunchError as error:
                    log.warning("%s: its logs are lost: %s", running.task.name, error)
            yield running.game, answer.played

    def cancel(self, game: Game) -> None:
        """End a game that is being played."""
        for running in [r for r in self._running if r.game == game]:
            self._running.remove(running)
            self._cluster.cancel(running.handle)

    def close(self) -> None:
        """End all games that are being played, and leave the cluster. Idempotent."""
        super().close()
        self._cluster.close()

    def _again(self, running: _Running) -> _Running | None:
        """The same game on another worker; None if too many have died of it."""
        if running.deaths + 1 >= DEATHS:
            return None
        handle = self._cluster.submit(running.task, running.match)
        return replace(running, handle=handle, deaths=running.deaths + 1)
