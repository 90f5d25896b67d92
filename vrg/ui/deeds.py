"""A player's activity, and the reason why it cannot move, in words. This draws nothing."""

from typing import Final

from vrg.bus.messages import DISQUALIFIED
from vrg.colours import Rgb
from vrg.ui import palette
from vrg.ui.scene import Scene, ScenePlayer

MAY_NOT_MOVE: Final = "it may not move now"
NO_CLOCK: Final = "the match clock has stopped"
LOW_BATTERY: Final = 0.2
"""The charge below which a battery is shown as low, 0 to 1."""
_BRIEFLY: Final = {"emergency stop": "stop"}
"""Words for what a player does that have no room, and others for them."""


def deed(player: ScenePlayer, *, driven: bool = False, brief: bool = False) -> tuple[str, Rgb]:
    """A player's activity in a word, and its colour.

    Args:
        driven: the user of this window drives it by hand. brief: there is little room.
    """
    if driven or player.by_hand:
        return "by hand", palette.CAUTION
    if player.out_of_play:
        return "out" if brief and player.state == DISQUALIFIED else player.state, palette.MUTED
    if player.battery is not None and player.battery < LOW_BATTERY:
        return f"{player.battery:.0%} left", palette.CAUTION
    word = player.mode.rpartition("/")[2] or player.state
    return _BRIEFLY.get(word, word), palette.MUTED


def hindrance(scene: Scene, player: ScenePlayer | None) -> str:
    """The reason why a player that a person drives cannot move, in words; empty if there is none, or no player."""
    if scene.estop:
        return "emergency stop: only an official releases it"
    if scene.halted is not None:
        return "play is halted: only an official continues it"
    if player is None:
        return ""
    if player.leased:
        return "the referee drives it"
    return player.fault or ("" if player.may_move else MAY_NOT_MOVE)
