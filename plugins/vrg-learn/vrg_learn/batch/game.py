"""What a game is for a batch: arrays, and functions that judge, drive and observe one match in them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from vrg_learn.batch.records import Record, Records, Singles, records
from vrg_learn.learning import Learning, Reward
from vrg_learn.rewards import WINNING


def calls(matches: int, players: int, most: int) -> Records:
    """Room for so many calls at a look.

    Its fields are those of vrg.coordinator.look; rules have their numbers in `BatchedGame.rules`.
    """
    return records(
        matches,
        total=(int,),
        rules=(int, most),
        players=(int, most),
        instants=(float, most),
        others=(bool, most, players),
    )


def worths(rules: Sequence[str], learning: Learning, *, shaping: bool) -> list[Reward]:
    """What calls of these rules are worth, as `reward` takes it.

    Args:
        shaping: whether calls that only lead to what counts are rewarded, too.
    """
    table = {**learning.rewards, **(learning.shaping if shaping else {})}
    return [table.get(rule, Reward()) for rule in rules]


def reward(s: Record, t: Record, c: Record, rewards: Singles) -> None:
    """Add what the calls of the last look are worth to each player of a match, and the winning of the game.

    As vrg_learn.rewards does, by `s.worth`, shape (rules, 4), and `s.sides`, the team of each player.
    """
    count = len(s.sides)
    for k in range(c.total):
        rule, first = c.rules[k], c.players[k]
        for n in range(count):
            if c.others[k, n]:
                rewards[n] += s.worth[rule, 1]
            if first >= 0:
                rewards[n] += s.worth[rule, 2] if s.sides[n] == s.sides[first] else s.worth[rule, 3]
        if first >= 0:
            rewards[first] += s.worth[rule, 0]
    if 0 <= t.winner < 2:
        for n in range(count):
            rewards[n] += WINNING if s.sides[n] == t.winner else -WINNING


class Functions(NamedTuple):
    """The functions of a game, which are given the records of one match; see those of a game.

    `numbers`, `place_of` and `flags` write what players see of the game, as vrg_learn.learning describes it.
    The last three are those of the teams that play by a strategy.
    """

    judge: Callable[..., bool]
    next_round: Callable[..., None]
    reset: Callable[..., None]
    drive: Callable[..., None]
    able: Callable[..., bool]
    numbers: Callable[..., int]
    place_of: Callable[..., tuple[float, float]]
    flags: Callable[..., int]
    forget: Callable[..., None]
    plan: Callable[..., None]
    decide: Callable[..., tuple[float, float]]


@dataclass(frozen=True)
class BatchedGame:
    """A game in a batch.

    Args:
        setting: what is the same in all matches. standing: how each stands, before its reset.
        calls: room for the calls of each. rules: the names of the rules of calls.
        teams: the names of the teams, by the numbers of winners. length: the number of values of an observation.
        places: how many places are in it.
        functions: those of one match; None for a game that referees judge.
        strategies: the names of those by which a team can play, by their numbers.
    """

    setting: Record
    standing: Records
    calls: Records
    rules: tuple[str, ...]
    teams: tuple[str, ...]
    length: int
    places: int = 0
    functions: Functions | None = None
    strategies: tuple[str, ...] = ()
