"""What plays the games of an experiment, several at a time: processes of this computer, or a cluster."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Self

from vrg.config.setup import MatchSetup
from vrg.evaluation.games import Game, Played


class Backend(ABC):
    """The contract of everything that plays games. A context manager that ends all games that are still being played.

    Whatever a backend is, the result of a game depends on the game alone, and a game that takes down its process takes
    down no other.

    Args:
        jobs: the number of games that are played at a time.
    """

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    @property
    def free(self) -> int:
        """The number of games that may be started now."""
        return self.jobs - len(self.games())

    @property
    def busy(self) -> bool:
        """Whether a game is being played."""
        return bool(self.games())

    @abstractmethod
    def games(self) -> list[Game]:
        """The games that are being played."""

    @abstractmethod
    def start(self, game: Game, setup: MatchSetup, limit: float) -> None:
        """Start a game.

        Args:
            setup: its match, as its match file in the folder of the experiment says; the seed is replaced.
            limit: the match time in s after which it is broken off.
        """

    @abstractmethod
    def finished(self, timeout: float) -> Iterator[tuple[Game, Played]]:
        """Wait at most `timeout` seconds for a game to end, and take away all games that have ended.

        Raises:
            LaunchError: no game can be played any more.
        """

    @abstractmethod
    def cancel(self, game: Game) -> None:
        """End a game that is being played. One that is not is ignored."""

    def close(self) -> None:
        """End all games that are being played. Idempotent."""
        for game in self.games():
            self.cancel(game)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
