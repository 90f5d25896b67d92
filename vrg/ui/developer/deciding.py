"""An official's buttons: what each is for, and whether it may be pressed now. This draws nothing."""

import enum
from typing import Final

import pygame

from vrg.bus.messages import DISQUALIFIED, OfficialAction, Stage
from vrg.ui.controls import Controls
from vrg.ui.developer import words
from vrg.ui.developer.insight import Insight


class Button(enum.Enum):
    """An official's button: its name, and its key, if it has one."""

    RESUME = ("Continue", "C")
    HALT = ("Halt", "H")
    RECOVER = ("Recover", "R")
    STOP = ("STOP", "SPACE")
    RELEASE = ("Release", "U")
    DISQUALIFY = ("Disqualify", "")
    REINSTATE = ("Reinstate", "")


_KEYS: Final = {
    Button.RESUME: pygame.K_c,
    Button.HALT: pygame.K_h,
    Button.RECOVER: pygame.K_r,
    Button.STOP: pygame.K_SPACE,
    Button.RELEASE: pygame.K_u,
}
"""The keys of the buttons: a button does what its key does."""
_ON_PLAYER: Final = {
    Button.DISQUALIFY: OfficialAction.DISQUALIFY,
    Button.REINSTATE: OfficialAction.REINSTATE,
}


def hindrance(button: Button, insight: Insight, selected: str | None) -> str:
    """Why a button may not be pressed now, in words; empty if it may. The referee may still refuse."""
    if button is Button.STOP:
        return ""
    if not insight.official:
        return words.REFUSED
    return _about_player(button, insight, selected) if button in _ON_PLAYER else ""


def _about_player(button: Button, insight: Insight, selected: str | None) -> str:
    player = None if insight.state is None or selected is None else insight.state.player(selected)
    if player is None:
        return words.SELECT_FIRST
    out = player.state == DISQUALIFIED
    if button is Button.DISQUALIFY and out:
        return f"{player.name} is disqualified already."
    if button is Button.REINSTATE and not out:
        return f"{player.name} is not disqualified."
    return ""


def useful(button: Button, insight: Insight, selected: str | None) -> bool:
    """Whether a button would change something now, as far as this window knows; the others are drawn quietly."""
    if hindrance(button, insight, selected):
        return False
    scene = insight.scene
    match button:
        case Button.RESUME:
            return scene.halted is not None and scene.stage is not Stage.GAME_OVER
        case Button.HALT:
            return scene.halted is None and scene.stage not in (None, Stage.GAME_OVER)
        case Button.RECOVER:
            return any(player.latched for player in scene.players)
        case Button.RELEASE:
            return scene.estop
        case _:
            return True


def press(button: Button, controls: Controls, insight: Insight, selected: str | None) -> str:
    """Do what a button is for, and return why not, in words; empty if it was done."""
    why = hindrance(button, insight, selected)
    if not why and button in _KEYS:
        controls.press(_KEYS[button], [player.name for player in insight.scene.players])
    elif not why and selected is not None:
        controls.decide(_ON_PLAYER[button], selected)
    return why


def refused_key(key: int, insight: Insight) -> str:
    """Why a key means nothing to this seat, in words; empty if it does."""
    official = key == pygame.K_TAB or key in {_KEYS[b] for b in _KEYS if b is not Button.STOP}
    return words.REFUSED if official and not insight.official else ""
