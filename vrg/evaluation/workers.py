"""Several games at a time on this computer, each in a process of its own."""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from vrg.config.setup import MatchSetup
from vrg.evaluation.backend import Backend
from vrg.evaluation.folder import ExperimentFolder
from vrg.evaluation.game_process import GameProcess, ended, server_for
from vrg.evaluation.games import Game, Played


@dataclass(frozen=True)
class _Running:
    game: Game
    process: GameProcess
    folder: Path


class Workers(Backend):
    """See the module.

    Args:
        jobs: the number of games that are played at a time.
        folder: the folder of the experiment.
        setup: a match of the experiment; what its game and its engine need is loaded in advance.
    """

    def __init__(self, jobs: int, folder: ExperimentFolder, setup: MatchSetup) -> None:
        super().__init__(jobs)
        self._folder = folder
        self._running: list[_Running] = []
        self._server = server_for(setup)

    def games(self) -> list[Game]:
        """The games that are being played."""
        return [running.game for running in self._running]

    def start(self, game: Game, setup: MatchSetup, limit: float) -> None:
        """Start a game; see `Backend.start`."""
        folder = self._folder.playing / self._folder.name_of(game)
        process = GameProcess(self._server, setup, game.seed, folder, limit)
        self._running.append(_Running(game, process, folder))

    def finished(self, timeout: float) -> Iterator[tuple[Game, Played]]:
        """Wait at most `timeout` seconds for a game to end, and take away all games that have ended."""
        results = dict(ended([running.process for running in self._running], timeout))
        for running in [r for r in self._running if r.process in results]:
            self._running.remove(running)
            result = results[running.process]
            self._put_away(running, keep=bool(result.failures or result.problem))
            yield running.game, result

    def cancel(self, game: Game) -> None:
        """End a game that is being played."""
        for running in [r for r in self._running if r.game == game]:
            self._running.remove(running)
            running.process.kill()
            self._put_away(running, keep=False)

    def close(self) -> None:
        """End all games that are being played. Idempotent."""
        super().close()
        self._server.close()
        shutil.rmtree(self._folder.playing, ignore_errors=True)

    def _put_away(self, running: _Running, *, keep: bool) -> None:
        """Remove what a game has written, or keep it with the failures."""
        if keep:
            target = self._folder.failures / running.folder.name
            shutil.rmtree(target, ignore_errors=True)
            target.parent.mkdir(exist_ok=True)
            if running.folder.exists():
                shutil.move(running.folder, target)
        else:
            shutil.rmtree(running.folder, ignore_errors=True)
