"""Colours and markers. Every role differs in both, so that no meaning hangs on colour alone."""

import enum
from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import Stage
from vrg.colours import OUT_OF_PLAY, Rgb, role_colour

BACKGROUND: Final[Rgb] = (12, 16, 22)
PANEL: Final[Rgb] = (20, 26, 34)
RAISED: Final[Rgb] = (31, 39, 50)
LINE: Final[Rgb] = (52, 62, 76)
FIELD: Final[Rgb] = (26, 35, 45)
GRID: Final[Rgb] = (33, 43, 55)
BORDER: Final[Rgb] = (205, 214, 224)
WALL: Final[Rgb] = (150, 160, 172)
TEXT: Final[Rgb] = (236, 240, 245)
MUTED: Final[Rgb] = (148, 160, 174)
INK: Final[Rgb] = (14, 18, 24)
"""Drawn upon a light colour."""

SAFE: Final[Rgb] = (0, 158, 115)
ALARM: Final[Rgb] = (196, 32, 38)
CAUTION: Final[Rgb] = (240, 190, 40)
GOOD: Final[Rgb] = (0, 130, 96)
CALM: Final[Rgb] = (38, 84, 124)
LOST: Final[Rgb] = (96, 74, 128)


class Marker(enum.Enum):
    """The sign on a robot's back."""

    TRIANGLE = "triangle"
    CIRCLE = "circle"
    SQUARE = "square"
    DIAMOND = "diamond"
    CROSS = "cross"


@dataclass(frozen=True)
class Style:
    """How a player is drawn."""

    colour: Rgb
    marker: Marker


_MARKERS: Final = {
    "shark": Marker.TRIANGLE,
    "minnow": Marker.CIRCLE,
    "pursuer": Marker.TRIANGLE,
    "intruder": Marker.DIAMOND,
    "attacker": Marker.TRIANGLE,
    "defender": Marker.SQUARE,
}

STAGE_COLOURS: Final[dict[Stage, Rgb]] = {
    Stage.INITIALIZE: CALM,
    Stage.PLAY_ROUND: GOOD,
    Stage.FOUL: CAUTION,
    Stage.ROUND_OVER: CALM,
    Stage.GAME_OVER: LOST,
}


def style_of(role: str, state: str) -> Style:
    """Colour and marker of a player; out of play it is grey with a cross."""
    marker = Marker.CROSS if state in OUT_OF_PLAY else _MARKERS.get(role, Marker.SQUARE)
    return Style(role_colour(role, state), marker)


def mix(colour: Rgb, other: Rgb, share: float) -> Rgb:
    """`share` 0 is `colour`, 1 is `other`."""
    return (
        round(colour[0] + (other[0] - colour[0]) * share),
        round(colour[1] + (other[1] - colour[1]) * share),
        round(colour[2] + (other[2] - colour[2]) * share),
    )


def ink_on(colour: Rgb) -> Rgb:
    """Dark or light text, whichever reads better upon `colour` (relative luminance as in WCAG 2)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in colour)]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return INK if luminance > 0.18 else TEXT
