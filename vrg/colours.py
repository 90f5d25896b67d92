"""The colours in which players are shown. People with any common kind of colour blindness can tell them apart."""

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


def hexadecimal(colour: Rgb) -> str:
    """A colour as browsers and terminals read it, such as `#0c1016`."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
