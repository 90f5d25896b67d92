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
GREY: Final[Rgb] = (142, 149, 160)

ON_WHITE: Final[tuple[Rgb, ...]] = (
    BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY_BLUE, (0, 0, 0),
    (0, 0, 255), (255, 0, 225), (0, 195, 0), (45, 0, 120), (255, 0, 90), (105, 90, 30), (105, 0, 15), (180, 120, 255),
    (150, 180, 60), (225, 150, 120), (30, 90, 90), (210, 0, 135), (90, 15, 75), (165, 180, 165), (15, 90, 0),
    (255, 0, 0), (0, 60, 225),
)  # fmt: skip
"""24 colours for lines upon white paper. The first seven are as above. Each of the others is as far as possible from
those before it in CIELAB, among colours of a lightness from 15 to 72; any two are more than 26 apart."""
