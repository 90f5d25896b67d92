"""What a program that learns to play needs to know of a game: what a player sees in numbers, and what it is paid for.

A game says only what is its own. `vrg.learning` lays the numbers out, with what is the same for all games, and adds up
the rewards. It needs neither numpy nor a library for learning here.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from vrg.agents.strategy import View
from vrg.bus.messages import PlayerStatus
from vrg.regions import Bounds
from vrg.types import Vector


class Reward(NamedTuple):
    """The rewards for one call of the referee. Who is concerned twice is given both.

    Args:
        first: of the first player that the call names. others: of each other player that it names.
        team: of each player of the team of the first one, that one too. rest: of each player of another team.
    """

    first: float = 0.0
    others: float = 0.0
    team: float = 0.0
    rest: float = 0.0


class Look(NamedTuple):
    """What one player sees of the game at one instant.

    Args:
        bounds: those of the field, m.
        numbers: the values of `Learning.numbers`, each within [-1, 1].
        places: the places of `Learning.places`, m in the map's frame.
        flags: returns the values of `Learning.flags` for another player whose pose is known, each 0 or 1.
        goal: the place to which the player makes progress, m in the map's frame; None if there is none now.
    """

    bounds: Bounds
    numbers: tuple[float, ...]
    places: tuple[Vector, ...]
    flags: Callable[[PlayerStatus], tuple[float, ...]]
    goal: Vector | None = None


@dataclass(frozen=True, kw_only=True)
class Learning:
    """What programs that learn a game need to know of it.

    Args:
        look: returns what a player sees of the game.
        numbers, places, flags: the names of what `look` returns, in its order.
        states: every state that a player may be in, besides `disqualified`.
        scan: True if players find others with their lasers, so that a scan belongs to what they see.
        talks: True if the rules need more of a player than its motion, such as sightings and bids. The strategy of the
            match file then goes on telling these for a player that a program drives.
        rewards: the rewards for calls, by rule. Those for winning are the same in all games.
        shaping: further rewards for calls that lead there, by rule, for those who want them.
    """

    look: Callable[[View], Look]
    numbers: tuple[str, ...]
    places: tuple[str, ...]
    flags: tuple[str, ...]
    states: tuple[str, ...]
    scan: bool = False
    talks: bool = False
    rewards: Mapping[str, Reward] = field(default_factory=dict)
    shaping: Mapping[str, Reward] = field(default_factory=dict)


def left(clock: float, limit: float | None) -> float:
    """The share of the time that is left, within [0, 1]; 1 without a limit.

    Args:
        clock: the time of play so far, s. limit: the time of play in s at which it is up, or None.
    """
    return 1.0 if not limit else max(0.0, 1.0 - clock / limit)
