"""The series of games of one pairing: which game is played next, which games count, and when it is decided.

Games finish in any order when several are played at a time. The series counts them by pairs, in the order of the pairs'
numbers, up to the pair that decides it. So its result is the same however many games are played at a time.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from vrg_league.evidence import ShareEstimate

FEW_PAIRS = 8
"""The number of pairs after which a strategy that has won all of them is better, at the usual confidence."""


@dataclass(frozen=True)
class SeriesResult:
    """The result of a series after a number of games: the share of the first strategy, and its interval, 0 to 1."""

    games: int
    share: float
    low: float
    high: float

    @property
    def decided(self) -> bool:
        """True if one strategy is better than the other."""
        return self.low > 0.5 or self.high < 0.5

    @property
    def mirrored(self) -> "SeriesResult":
        """The same, seen from the second strategy."""
        return SeriesResult(self.games, 1.0 - self.share, 1.0 - self.high, 1.0 - self.low)


class Series:
    """The series of games of one pairing.

    Args:
        pairs: the number of pairs after which the series ends in every case.
        confidence: of the interval, see `ShareEstimate`.
        play_all: True counts all pairs; False stops after the pair that decides the series.

    Attributes:
        standings: the standing after each pair that counts.
    """

    def __init__(self, pairs: int, confidence: float, *, play_all: bool) -> None:
        self.pairs = pairs
        self.standings: list[SeriesResult] = []
        self._play_all = play_all
        self._evidence = ShareEstimate(confidence)
        self._points: dict[int, float] = {}
        self._next = 0

    def add(self, number: int, points: float) -> None:
        """Add a game that has been played.

        Args:
            number: the number of the game. points: those of the first strategy.
        """
        self._points[number] = points
        while not self.over and (pair := _pair(self._points, len(self.standings))) is not None:
            self._evidence.add(pair)
            low, high = self._evidence.interval()
            self.standings.append(SeriesResult(2 * self._evidence.pairs, self._evidence.share or 0.0, low, high))

    @property
    def over(self) -> bool:
        """True if no more game is needed."""
        decided = self.standing is not None and self.standing.decided
        return len(self.standings) >= self.pairs or (not self._play_all and decided)

    @property
    def standing(self) -> SeriesResult | None:
        """The standing after the last pair that counts; None if there is no such pair."""
        return self.standings[-1] if self.standings else None

    @property
    def counted(self) -> int:
        """The number of games that count: those with lower numbers than this."""
        return 2 * len(self.standings)

    @property
    def missing(self) -> int | None:
        """The number of further games that would show which one is better, if they went as those so far; None if that
        takes more than FEW_PAIRS and more than as many again."""
        pairs = self._evidence.missing(max(FEW_PAIRS, self._evidence.pairs))
        return None if pairs is None else 2 * pairs

    @property
    def left(self) -> int:
        """The most games that may still count."""
        return 0 if self.over else 2 * self.pairs - self.counted

    @property
    def upcoming(self) -> int | None:
        """The number of the next game to begin with; None if none is needed any more."""
        while self._next in self._points:
            self._next += 1
        return self._next if self._next < 2 * self.pairs and not self.over else None

    def begin(self) -> None:
        """The upcoming game is being played."""
        self._next += 1


def _pair(points: Mapping[int, float], number: int) -> float | None:
    """The mean of the points of a pair; None if one of its games is missing."""
    games = points.get(2 * number), points.get(2 * number + 1)
    return None if games[0] is None or games[1] is None else (games[0] + games[1]) / 2
