"""The colours of the windows. The colours and markers of players belong to their game, `vrg.games.game.Game.style`."""

from typing import Final

from vrg.bus.messages import Stage
from vrg.colours import DARK, Rgb

BACKGROUND: Final[Rgb] = (12, 16, 22)
APRON: Final[Rgb] = DARK.ground
"""The ground around a field."""
PANEL: Final[Rgb] = (20, 26, 34)
RAISED: Final[Rgb] = (31, 39, 50)
LINE: Final[Rgb] = (52, 62, 76)
FIELD: Final[Rgb] = DARK.field
BORDER: Final[Rgb] = DARK.border
WALL: Final[Rgb] = DARK.wall
WALL_EDGE: Final[Rgb] = DARK.wall_edge
TEXT: Final[Rgb] = DARK.text
MUTED: Final[Rgb] = DARK.muted
INK: Final[Rgb] = DARK.ink
"""For what is written upon a light colour."""

SAFE: Final[Rgb] = DARK.safe
ALARM: Final[Rgb] = (196, 32, 38)
CAUTION: Final[Rgb] = DARK.caution
GOOD: Final[Rgb] = (0, 118, 87)
CALM: Final[Rgb] = (38, 84, 124)
LOST: Final[Rgb] = (96, 74, 128)
WARNING: Final[Rgb] = (255, 128, 112)
"""For what is written in a warning colour upon a panel."""
SCAN: Final[Rgb] = (34, 66, 84)
"""The ground that a laser scan has found to be free."""
ECHO: Final[Rgb] = (86, 180, 233)
"""The echoes of a laser or a sonar."""

STAGE_COLOURS: Final[dict[Stage, Rgb]] = {
    Stage.INITIALIZE: CALM,
    Stage.PLAY_ROUND: GOOD,
    Stage.ROUND_OVER: CALM,
    Stage.GAME_OVER: LOST,
}


def ink_on(colour: Rgb) -> Rgb:
    """The colour of dark or of light text, whichever reads better upon `colour`."""
    return INK if luminance(colour) > 0.18 else TEXT


def luminance(colour: Rgb) -> float:
    """The relative luminance of a colour, 0 to 1 (WCAG 2)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
