"""The colours in which players are shown. People with any common kind of colour blindness can tell them apart."""

from dataclasses import dataclass
from typing import Final

Rgb = tuple[int, int, int]
"""Red, green and blue, each 0 to 255."""

# Okabe and Ito (2008), "Color Universal Design".
VERMILLION: Final[Rgb] = (213, 94, 0)
SKY_BLUE: Final[Rgb] = (86, 180, 233)
ORANGE: Final[Rgb] = (230, 159, 0)
GREEN: Final[Rgb] = (0, 158, 115)
YELLOW: Final[Rgb] = (240, 228, 66)
BLUE: Final[Rgb] = (0, 114, 178)
PURPLE: Final[Rgb] = (204, 121, 167)
RED: Final[Rgb] = (228, 70, 56)
"""For a team whose name is red, beside blue: people call vermillion orange."""
GREY: Final[Rgb] = (142, 149, 160)

WHITE: Final[Rgb] = (255, 255, 255)


def dulled(colour: Rgb) -> Rgb:
    """A colour halfway to grey, which is still told from another one."""
    red, green, blue = ((part + grey) // 2 for part, grey in zip(colour, GREY, strict=True))
    return red, green, blue


def mix(colour: Rgb, other: Rgb, share: float) -> Rgb:
    """Mix two colours: `share` 0 gives `colour`, 1 gives `other`."""
    return (
        round(colour[0] + (other[0] - colour[0]) * share),
        round(colour[1] + (other[1] - colour[1]) * share),
        round(colour[2] + (other[2] - colour[2]) * share),
    )


@dataclass(frozen=True)
class Theme:
    """The colours of what lies on a field, but for those of the players.

    Args:
        ground: around the field. field, grid: of the field. border: its border. wall, wall_edge: of walls and
            obstacles. safe: of a safe zone. caution: of what must be noticed. ink: upon a light colour.
    """

    ground: Rgb
    field: Rgb
    grid: Rgb
    border: Rgb
    wall: Rgb
    wall_edge: Rgb
    text: Rgb
    muted: Rgb
    ink: Rgb = (14, 18, 24)
    safe: Rgb = GREEN
    caution: Rgb = (240, 190, 40)


DARK: Final = Theme(
    ground=(17, 22, 29), field=(26, 35, 45), grid=(33, 43, 55), border=(205, 214, 224), wall=(104, 114, 128),
    wall_edge=(168, 178, 190), text=(236, 240, 245), muted=(148, 160, 174),
)  # fmt: skip
"""For screens."""
PAPER: Final = Theme(
    ground=WHITE, field=WHITE, grid=(244, 244, 244), border=(64, 64, 64), wall=(184, 184, 184),
    wall_edge=(128, 128, 128), text=(30, 30, 30), muted=(120, 120, 120),
)  # fmt: skip
"""For plots."""


def hexadecimal(colour: Rgb) -> str:
    """A colour as browsers and terminals read it, such as `#0c1016`."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
