"""Brackets: who meets whom in single and in double elimination, and what follows from who has won so far.

A bracket is a list of pairings in the order of play, made once from the number of places. All else follows from the
winners so far, so nothing more has to be kept. A seed is a place in the ranking before the bracket, from 0 for the best
one.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple


class Source(NamedTuple):
    """Where one of a pairing comes from.

    Args:
        kind: "seed"; or "winner" or "loser" of an earlier pairing.
        number: the seed from 0, or the number of the pairing from 0.
    """

    kind: str
    number: int


class Pairing(NamedTuple):
    """Two that meet.

    Args:
        first, second: where the two come from. The first of two seeds is the better one. Where one comes from the
            winners' side and one from the losers' side, the first one comes from the winners' side.
        side: "winners", "losers", or "final" for the last pairing, in single elimination, too.
        round: from 1 within its side.
        again: True for the second final of double elimination. It is played only if the winner of the winners' side has
            lost the first one, since then each of the two has lost once.
    """

    first: Source
    second: Source
    side: str
    round: int
    again: bool


_Line = Sequence[Source | None]
"""Those of a round, side by side. None where there is nobody: whoever should meet that one goes on unplayed."""


def single(places: int) -> list[Pairing]:
    """Single elimination: whoever loses is out. There are `places - 1` pairings.

    The two best seeds can meet in the last one only. Where `places` is no power of two, the best ones have byes.

    Raises:
        ValueError: there are not 2 to 64 places.
    """
    pairings: list[Pairing] = []
    line = _seeds(places)
    while len(line) > 1:
        line, _ = _round(pairings, line[::2], line[1::2], "winners" if len(line) > 2 else "final")
    return pairings


def double(places: int) -> list[Pairing]:
    """Double elimination: whoever loses twice is out. There are at most `2 * places - 1` pairings.

    The losers of the winners' side join the losers' side from the other end in one round, and from the other half in
    the next one, so that those who have met do not meet again soon.

    Raises:
        ValueError: there are not 2 to 64 places.
    """
    pairings: list[Pairing] = []
    seeds = _seeds(places)
    line, left = _round(pairings, seeds[::2], seeds[1::2], "winners")
    while len(line) > 1:
        left, _ = _round(pairings, left[::2], left[1::2], "losers")
        line, lost = _round(pairings, line[::2], line[1::2], "winners")
        half = len(lost) // 2
        joining = [*lost[half:], *lost[:half]] if pairings[-1].round % 2 else lost[::-1]
        left, _ = _round(pairings, joining, left, "losers")
    _round(pairings, line, left, "final")
    final = len(pairings) - 1
    return [*pairings, Pairing(Source("loser", final), Source("winner", final), "final", 2, again=True)]


def entrants(pairings: Sequence[Pairing], number: int, winners: Mapping[int, int]) -> tuple[int | None, int | None]:
    """The seeds of the two that meet in a pairing, each None while it is unknown.

    Args:
        number: of the pairing, from 0.
        winners: the seeds of the winners so far, by the number of the pairing.

    Raises:
        ValueError: the winner of this pairing or of an earlier one is none of the two that meet in it.
    """
    found: list[tuple[int | None, int | None]] = []

    def seed(source: Source) -> int | None:
        if source.kind == "seed":
            return source.number
        winner = winners.get(source.number)
        return winner if source.kind == "winner" else _loser(found[source.number], winner)

    for earlier, pairing in enumerate(pairings[: number + 1]):
        found.append((seed(pairing.first), seed(pairing.second)))
        if (winner := winners.get(earlier)) is not None and winner not in found[-1]:
            raise ValueError(f"pairing {earlier}: expected a winner among the seeds {found[-1]}, got {winner}")
    return found[number]


def is_needed(pairings: Sequence[Pairing], number: int, winners: Mapping[int, int]) -> bool | None:
    """Whether a pairing is to be played: False for a second final that the first one has made needless; None: unknown.

    Args:
        number, winners: as for `entrants`.

    Raises:
        ValueError: as for `entrants`.
    """
    if not pairings[number].again:
        return True
    winner = winners.get(number - 1)
    return None if winner is None else winner != entrants(pairings, number - 1, winners)[0]


def champion(pairings: Sequence[Pairing], winners: Mapping[int, int]) -> int | None:
    """The seed that has won the bracket; None while that is open.

    Args:
        winners: as for `entrants`.

    Raises:
        ValueError: as for `entrants`.
    """
    return winners.get(_last(pairings, winners))


def _seeds(places: int) -> _Line:
    """The seeds in the order of the first round, where the best one and the second best one are in different halves.

    Raises:
        ValueError: there are not 2 to 64 places.
    """
    if not 2 <= places <= 64:
        raise ValueError(f"expected 2 to 64 places in a bracket, got {places}")
    order = [0]
    while len(order) < places:
        order = [seed for one in order for seed in (one, 2 * len(order) - 1 - one)]
    return [Source("seed", seed) if seed < places else None for seed in order]


def _round(pairings: list[Pairing], firsts: _Line, seconds: _Line, side: str) -> tuple[_Line, _Line]:
    """Append the pairings of a round; its winners and its losers, with None where there is none."""
    number = 1 + max((pairing.round for pairing in pairings if pairing.side == side), default=0)
    won: list[Source | None] = []
    lost: list[Source | None] = []
    for first, second in zip(firsts, seconds, strict=True):
        won.append(Source("winner", len(pairings)) if first and second else first or second)
        lost.append(Source("loser", len(pairings)) if first and second else None)
        if first and second:
            pairings.append(Pairing(first, second, side, number, again=False))
    return won, lost


def _loser(two: tuple[int | None, int | None], winner: int | None) -> int | None:
    """The other one of two; None while the winner is unknown."""
    return None if winner is None else two[winner == two[0]]


def _last(pairings: Sequence[Pairing], winners: Mapping[int, int]) -> int:
    """The number of the pairing that settles the bracket."""
    last = len(pairings) - 1
    return last - 1 if is_needed(pairings, last, winners) is False else last
