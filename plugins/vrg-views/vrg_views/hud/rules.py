"""The rules of the Player HUD: those of practice, which are none."""

from vrg.games.practice.rules import Practice
from vrg_views.hud.game import GAME


class PlayerHud(Practice):
    """The rule book of the Player HUD."""

    name = GAME.name
    round_word = GAME.round_word
