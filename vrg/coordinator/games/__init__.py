"""The rule books, by the name of their game."""

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel

from vrg.coordinator.games import sharks_and_minnows
from vrg.coordinator.rulebook import Contestant, RuleBook
from vrg.errors import ConfigError


class Game(BaseModel, arbitrary_types_allowed=True, frozen=True):
    """How a game is set up.

    Args:
        settings: the model of the match file's [rules] table.
        roles: what a player's `role` may be.
        rulebook: makes the rule book; raises ConfigError, all reasons at once, for a set-up that cannot be played.
    """

    settings: type[BaseModel]
    roles: tuple[str, ...]
    rulebook: Any


GAMES = {
    "sharks-and-minnows": Game(
        settings=sharks_and_minnows.Settings,
        roles=(sharks_and_minnows.SHARK, sharks_and_minnows.MINNOW),
        rulebook=sharks_and_minnows.SharksAndMinnows,
    )
}


def make_rulebook(game: str, settings: BaseModel, contestants: Sequence[Contestant]) -> RuleBook[Any]:
    """The rule book of a game.

    Raises:
        ConfigError: no such game, or a set-up that cannot be played.
    """
    if game not in GAMES:
        raise ConfigError([f"game: expected one of {', '.join(sorted(GAMES))}, got {game!r}"])
    book: RuleBook[Any] = GAMES[game].rulebook(settings, contestants)
    return book
