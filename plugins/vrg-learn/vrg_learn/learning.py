"""What a program that learns to play needs to know of a game: what a player sees in numbers, and what it is paid for.

A game has only what is its own here. The other modules lay the numbers out, with what is the same for all games, and
add up the rewards. This one, and those in `vrg_learn/games/`, need neither numpy nor a library for learning.

A package outside may add what its game has by an entry point of the group `vrg.learning` with the name of the game:

    [project.entry-points."vrg.learning"]
    my-game = "my_package.observation:LEARNING"
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

from vrg.agents.strategy import View
from vrg.bus.messages import PlayerStatus
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.regions import Bounds
from vrg.registry import Registry
from vrg.types import Vector


class Reward(NamedTuple):
    """The rewards for one call of the referee. A player that is concerned twice gets both.

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


LEARNINGS: Final[Registry[Learning]] = Registry(
    "game that can be learned",
    "vrg.learning",
    {
        "sharks-and-minnows": "vrg_learn.games.sharks_and_minnows:LEARNING",
        "pursuit-evasion": "vrg_learn.games.pursuit_evasion:LEARNING",
        "roboflag": "vrg_learn.games.roboflag:LEARNING",
    },
    lambda found: None if isinstance(found, Learning) else "expected a vrg_learn.learning.Learning",
)
"""What programs that learn a game need to know of it, by the game's name."""


def learning_of(game: str, place: str | Path | None = None) -> Learning:
    """What programs that learn a game need to know of it: what its package says, or else what its rule book publishes.

    Args:
        place: where the game is named, such as a file; errors begin with it.

    Raises:
        ConfigError: there is no game of this name, or what programs need of it cannot be imported.
    """
    try:
        if game not in LEARNINGS and (known := GAMES.find(game)) is not None:
            from vrg_learn.default import default_of  # noqa: PLC0415 - it needs the rules, and other games do not

            return default_of(known)
        return LEARNINGS.get(game)
    except ConfigError as error:
        if place is None:
            raise
        raise ConfigError(f"{place}: {error}") from None


def left(clock: float, limit: float | None) -> float:
    """The share of the time that is left, within [0, 1]; 1 without a limit.

    Args:
        clock: the time of play so far, s. limit: the time of play in s at which it is up, or None.
    """
    return 1.0 if not limit else max(0.0, 1.0 - clock / limit)
