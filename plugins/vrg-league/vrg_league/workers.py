"""Several games at a time, each in its own process."""

import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Self

from vrg.bus.stopping import StopSignal
from vrg.config.setup import CheckedMatch
from vrg.errors import LaunchError
from vrg.registry import Registry, subclass_of
from vrg.runs.run_folder import delete, scratch_folder
from vrg_league.folder import ExperimentFolder
from vrg_league.game_process import GameProcess, ended, server_for
from vrg_league.games import Played, ScheduledGame

TIMED = 20.0
"""The match time in s of the beginning of a game that tells how fast games are played."""
_PATIENCE = 20.0
"""The real time in s that this beginning may take."""
_LOOK = 0.1
"""The real time in s between two looks at whether to stop."""


class Workers:
    """Plays the games of an experiment on this computer; a context manager, which ends those that are being played.

    The result of a game depends on the game alone, and one that takes down its process takes down no other. Games may
    be played elsewhere by a subclass, which overrides `games` and the methods after it.

    Args:
        jobs: the number of games that are played at a time. folder: the folder of the experiment.
        setup: a match of the experiment; what its game and its engine need is loaded in advance.
    """

    def __init__(self, jobs: int, folder: ExperimentFolder, setup: CheckedMatch) -> None:
        self.jobs = jobs
        self._folder = folder
        self._running: dict[GameProcess, ScheduledGame] = {}
        self._server = server_for(setup.game, setup.engine)

    @staticmethod
    def require() -> None:
        """Check that what it needs is installed, before anything else is done.

        Raises:
            LaunchError: it is not.
        """

    @classmethod
    def at(cls, address: str, jobs: int | None, cores: int, folder: ExperimentFolder) -> "Workers":
        """What plays games elsewhere, of a subclass that other packages add to WORKERS.

        Args:
            address: where, as it was typed. jobs: the number of games at a time; None for as many as can be played.
            cores: those of this computer. folder: of the experiment.

        Raises:
            LaunchError: it cannot be used.
        """
        raise NotImplementedError

    @property
    def free(self) -> int:
        """The number of games that may be started now."""
        return self.jobs - len(self.games())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def games(self) -> list[ScheduledGame]:
        """The games that are being played."""
        return list(self._running.values())

    def minute(self, setup: CheckedMatch, stop: StopSignal) -> float | None:
        """The real time in s that a minute of a match takes, by its first TIMED s; None if that is not known.

        Args:
            stop: ends the measurement when it is set.
        """
        began = time.monotonic()
        with scratch_folder() as place, suppress(LaunchError):  # the games will tell why none can be played
            game = GameProcess(self._server, setup, setup.seed, place, TIMED)
            found = list[tuple[GameProcess, Played]]()
            try:
                while not found and not stop.is_set() and time.monotonic() - began < _PATIENCE:
                    found = ended([game], _LOOK)
            finally:
                game.kill()
            if found and found[0][1].match_time:
                return (time.monotonic() - began) * 60.0 / found[0][1].match_time
        return None

    def start(self, game: ScheduledGame, setup: CheckedMatch, limit: float) -> None:
        """Start a game.

        Args:
            setup: its match, as in its match file in the folder of the experiment; the seed is replaced.
            limit: the match time in s after which it is broken off.
        """
        folder = self._folder.playing / self._folder.name_of(game)
        branch = self._folder.branch(game)
        self._running[GameProcess(self._server, setup, game.seed, folder, limit, branch, shows=self._folder.shows)] = (
            game
        )

    def finished(self, timeout: float) -> Iterator[tuple[ScheduledGame, Played]]:
        """Wait at most `timeout` seconds for a game to end, and take away all games that have ended.

        Raises:
            LaunchError: no game can be played any more.
        """
        for process, result in ended(list(self._running), timeout):
            game = self._running.pop(process)
            self._folder.keep(game, process.folder)
            if result.failures or result.problem:
                target = self._folder.failures / process.folder.name
                delete(target)
                target.parent.mkdir(exist_ok=True)
                if process.folder.exists():
                    shutil.move(process.folder, target)
            delete(process.folder)
            yield game, result

    def cancel(self, game: ScheduledGame) -> None:
        """End a game that is being played. One that is not is ignored."""
        for process in [process for process, played in self._running.items() if played == game]:
            del self._running[process]
            process.kill()
            delete(process.folder)

    def close(self) -> None:
        """End all games that are being played. Idempotent."""
        for game in self.games():
            self.cancel(game)
        self._server.close()
        delete(self._folder.playing)


WORKERS: Registry[type[Workers]] = Registry("place for games", "vrg.workers", {}, subclass_of(Workers))
"""What plays games elsewhere, of other packages, by the option of `vrg compare` that asks for it."""
