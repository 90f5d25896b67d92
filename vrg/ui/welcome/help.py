"""Draws the list of the keys over a window."""

from collections.abc import Sequence

import pygame

from vrg.ui import palette, shapes
from vrg.ui.text import Face, Fonts


def draw_keys(surface: pygame.Surface, keys: Sequence[tuple[str, str]], ui: float, fonts: Fonts) -> pygame.Rect:
    """Draw the keys and what they do in the middle of a surface; return where."""
    size, step, pad = max(12, round(15 * ui)), round(26 * ui), round(20 * ui)
    left = max(fonts.width(key, size, Face.BOLD) for key, _ in keys)
    right = max(fonts.width(meaning, size) for _, meaning in keys)
    plate = pygame.Rect(0, 0, left + right + 3 * pad, step * len(keys) + 2 * pad)
    plate.center = surface.get_rect().center
    shapes.pill(surface, plate, palette.RAISED, 245, radius=round(8 * ui))
    for index, (key, meaning) in enumerate(keys):
        y = plate.top + pad + index * step + step // 2
        sign = fonts.render(key, size, palette.CAUTION, Face.BOLD)
        surface.blit(sign, sign.get_rect(midleft=(plate.left + pad, y)))
        text = fonts.render(meaning, size, palette.TEXT)
        surface.blit(text, text.get_rect(midleft=(plate.left + 2 * pad + left, y)))
    return plate
