"""The ranking of a qualification: who has done best, though some may have played more matches than others."""

from collections import Counter
from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import combinations, groupby
from typing import NamedTuple


class Result(NamedTuple):
    """What has come out of a match.

    Args:
        first, second: the names of the two. points: the score of each.
        winner: 0 for the first, 1 for the second, None for a draw. It need not follow from the score.
    """

    first: str
    second: str
    points: tuple[int, int]
    winner: int | None


class Row(NamedTuple):
    """A row of the ranking.

    Args:
        place: from 1; equal ones share it, and the places after it are left out: 1, 1, 3.
        points: ranking points, 2 for a win and 1 for a draw. score: its own, in all.
        difference: its score less that of its opponents, in all.
    """

    place: int
    name: str
    played: int
    wins: int
    draws: int
    losses: int
    points: int
    difference: int
    score: int


def ranking(names: Sequence[str], results: Iterable[Result]) -> list[Row]:
    """The rows of all names, the best first.

    Ranking points per match played decide, so that one match more is no advantage; then the difference of the score per
    match; then the score per match; then the ranking points in the matches among those who are equal so far, if each of
    them has met each other one equally often. Those who are still equal share a place, in the order of `names`.
    Whoever has not played comes last.

    Raises:
        ValueError: a result has a name that is not among `names`.
    """
    results = list(results)
    if unknown := {name for result in results for name in result[:2]} - {*names}:
        raise ValueError(f"expected results of {', '.join(names)}, got some of {', '.join(sorted(unknown))}")
    rows, direct = [_row(name, results) for name in names], dict[str, int]()
    for _, group in groupby(sorted(rows, key=_key), _key):
        direct |= _direct([row.name for row in group], results)
    rows.sort(key=lambda row: (_key(row), direct[row.name]), reverse=True)
    keys = [(_key(row), direct[row.name]) for row in rows]
    return [row._replace(place=1 + keys.index(key)) for row, key in zip(rows, keys, strict=True)]


def _key(row: Row) -> tuple[Fraction, ...]:
    """What decides without the direct comparison; more is better."""
    return tuple(Fraction(n, row.played or 1) for n in (row.played, row.points, row.difference, row.score))


def _row(name: str, results: Iterable[Result]) -> Row:
    """What somebody has done in all matches of some results; the place is left open, 0."""
    own = [(result, result[:2].index(name)) for result in results if name in result[:2]]
    wins, draws = sum(result.winner == side for result, side in own), sum(result.winner is None for result, _ in own)
    score = sum(result.points[side] for result, side in own)
    other = sum(result.points[1 - side] for result, side in own)
    return Row(0, name, len(own), wins, draws, len(own) - wins - draws, 2 * wins + draws, score - other, score)


def _direct(group: Sequence[str], results: Iterable[Result]) -> dict[str, int]:
    """The ranking points in the matches among some; all 0 if not each of them has met each other one equally often."""
    among = [result for result in results if {*result[:2]} <= {*group}]
    met = Counter(frozenset(result[:2]) for result in among)
    if len({met[frozenset(pair)] for pair in combinations(group, 2)}) != 1:
        return dict.fromkeys(group, 0)
    return {name: _row(name, among).points for name in group}
