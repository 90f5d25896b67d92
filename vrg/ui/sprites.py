"""Draws a robot seen from above. It is larger than needed and faces right, so that it can be turned smoothly."""

from typing import Final

import pygame

from vrg.games.game import Marker, Style
from vrg.ui import palette, shapes

FINENESS: Final = 2
"""The factor by which a robot is drawn larger than it is shown."""
NOSE: Final = 0.3
"""The length of the nose ahead of the body, as a part of the body's length."""


def robot_sprite(style: Style, physical: bool, length: int, width: int) -> pygame.Surface:
    """Draw a body of `length` by `width` pixels with a nose upon a transparent surface, and with its role's marker.

    The body's centre is the middle of the surface. A physical robot has a white rim, a virtual one a dark one. A cross
    is left out, which stays upright and is drawn later.
    """
    long, wide = length * FINENESS, width * FINENESS
    rim = (3 if physical else 1) * FINENESS
    nose = round(NOSE * long)
    half = long // 2 + rim + nose + 2
    surface = pygame.Surface((2 * half, 2 * half), pygame.SRCALPHA)
    body = pygame.Rect(0, 0, long, wide)
    body.center = (half, half)
    edge = palette.TEXT if physical else palette.INK
    # Without the colour of the rim around it, the smoothed edge would be mixed with black.
    surface.fill((*edge, 0))
    corner = max(2, round(0.12 * wide))
    light = palette.mix(style.colour, palette.TEXT, 0.75)
    tip = [(body.right + rim + nose, half), (body.right, half - 0.36 * wide), (body.right, half + 0.36 * wide)]
    shapes.polygon(surface, tip, light)
    pygame.draw.rect(surface, edge, body.inflate(2 * rim, 2 * rim), border_radius=corner + rim)
    pygame.draw.rect(surface, style.colour, body, border_radius=corner)
    if style.marker is not Marker.CROSS:
        shapes.marker(surface, (half, half), 0.0, wide * 0.33, palette.INK, style.marker)
    return surface
