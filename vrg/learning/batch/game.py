"""What a game is for a batch: arrays, and functions that judge, drive and observe one match in them."""

from collections.abc import Callable
from dataclasses import dataclass

from vrg.learning.batch.records import Record, Records, records
from vrg.learning.batch.stepping import Functions


def calls(matches: int, players: int, most: int) -> Records:
    """Room for so many calls at a look.

    Fields: `total`: how many there are; and of each of them `rules`: its number in `BatchedGame.rules`; `players`: the row
    of the first player that it names, -1 if it names none first; `others`: which others it names.
    """
    return records(matches, total=(int,), rules=(int, most), players=(int, most), others=(bool, most, players))


def call(c: Record, rule: int, player: int) -> int:
    """Add a call about a player to those of a match, and return its number."""
    k = c.total
    c.rules[k], c.players[k] = rule, player
    c.others[k, :] = False
    c.total = k + 1
    return int(k)


@dataclass(frozen=True)
class BatchedGame:
    """A game in a batch.

    Args:
        setting: what is the same in all matches. standing: makes the arrays of so many matches.
        calls: makes room for the calls of so many matches. rules: the names of the rules of calls.
        length: the number of values of an observation.
        functions: those of one match.
    """

    setting: Record
    standing: Callable[[int], Records]
    calls: Callable[[int], Records]
    rules: tuple[str, ...]
    length: int
    functions: Functions
