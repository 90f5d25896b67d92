"""A bracket: the first of a leaderboard against the last, and the winners of neighbours against each other."""

from collections.abc import Sequence
from typing import NamedTuple


class Pair(NamedTuple):
    """Two that play against each other; the first one has the higher place, and goes on where there is no other."""

    first: str
    second: str | None

    def __str__(self) -> str:
        return self.first if self.second is None else f"{self.first} against {self.second}"


def first_round(best: Sequence[str]) -> list[Pair]:
    """The pairs of the first round, such that the two best ones can meet only in the last one.

    Args:
        best: the names, the best one first. Where there is no power of two of them, the best ones go on unplayed.
    """
    size = 1
    while size < len(best):
        size *= 2
    order = [0]
    while len(order) < size:
        order = [place for one in order for place in (one, 2 * len(order) - 1 - one)]
    # Of two neighbours the first one has the higher place, so only the second one can be missing.
    names = [best[place] if place < len(best) else None for place in order]
    return [Pair(str(a), b) for a, b in zip(names[::2], names[1::2], strict=True)] if size > 1 else []


def next_round(winners: Sequence[str], best: Sequence[str]) -> list[Pair]:
    """The pairs of the winners of a round; none once one is left.

    Args:
        best: as for `first_round`.
    """
    if len(winners) < 2:
        return []
    return [Pair(*sorted(two, key=best.index)) for two in zip(winners[::2], winners[1::2], strict=True)]
