"""The rules of the Player HUD: none, as in practice. It lasts until the time is up or an official ends it."""

from vrg.games.hud import GAME
from vrg.games.practice.rules import Practice


class PlayerHud(Practice):
    """The rule book of the Player HUD."""

    name = GAME.name
    round_word = GAME.round_word
