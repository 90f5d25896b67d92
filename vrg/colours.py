"""What colour a player has, wherever it is shown."""

import zlib
from typing import Final

Rgb = tuple[int, int, int]
"""Each 0 to 255."""

# Okabe and Ito (2008), "Color Universal Design": told apart with every common kind of colour blindness.
VERMILLION: Final[Rgb] = (213, 94, 0)
SKY_BLUE: Final[Rgb] = (86, 180, 233)
ORANGE: Final[Rgb] = (230, 159, 0)
GREEN: Final[Rgb] = (0, 158, 115)
YELLOW: Final[Rgb] = (240, 228, 66)
BLUE: Final[Rgb] = (0, 114, 178)
PURPLE: Final[Rgb] = (204, 121, 167)
GREY: Final[Rgb] = (142, 149, 160)

OUT_OF_PLAY: Final = frozenset({"inactive", "tagged", "captured", "escaped"})
"""States in which a player is only an obstacle."""
ROLE_COLOURS: Final[dict[str, Rgb]] = {
    "shark": VERMILLION,
    "minnow": SKY_BLUE,
    "pursuer": ORANGE,
    "intruder": PURPLE,
    "attacker": ORANGE,
    "defender": BLUE,
    "robot": GREEN,
}


def role_colour(role: str, state: str = "") -> Rgb:
    """The colour of a player: grey out of play; a role that has none of its own gets one by its name."""
    if state in OUT_OF_PLAY:
        return GREY
    known = ROLE_COLOURS.get(role)
    if known is not None:
        return known
    rest = (GREEN, YELLOW, BLUE, PURPLE)
    return rest[zlib.crc32(role.encode()) % len(rest)]
