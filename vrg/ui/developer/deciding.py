"""An official's buttons: what each is for, and whether it may be pressed now. This draws nothing."""

import enum
from typing import Final

from vrg.bus.messages import DISQUALIFIED, OfficialAction, Stage
from vrg.ui.acts import Act
from vrg.ui.developer import words
from vrg.ui.developer.insight import Insight
from vrg.ui.window_node import REFUSED


class Button(enum.Enum):
    """An official's button: its name, and its key, if it has one."""

    RESUME = ("Continue", "C")
    HALT = ("Halt", "H")
    RECOVER = ("Recover", "R")
    STOP = ("STOP", "SPACE")
    RELEASE = ("Release", "U")
    DISQUALIFY = ("Disqualify", "")
    REINSTATE = ("Reinstate", "")


ACTS: Final = {
    Button.RESUME: Act.CONTINUE,
    Button.HALT: Act.HALT,
    Button.RECOVER: Act.RECOVER,
    Button.STOP: Act.STOP,
    Button.RELEASE: Act.RELEASE,
}
"""The acts of the buttons: a button does what its key does."""
ON_PLAYER: Final = {
    Button.DISQUALIFY: OfficialAction.DISQUALIFY,
    Button.REINSTATE: OfficialAction.REINSTATE,
}


def disabled_reason(button: Button, insight: Insight, selected: str | None) -> str:
    """Why a button may not be pressed now, in words; empty if it may. The referee may still refuse."""
    if button is Button.STOP:
        return ""
    if not insight.official:
        return REFUSED
    return _about_player(button, insight, selected) if button in ON_PLAYER else ""


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
    """True if a button would change something now, as far as this window knows; the others are drawn quietly."""
    if disabled_reason(button, insight, selected):
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
