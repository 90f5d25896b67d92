"""Draws the strip below the field: a scale, where x and y point, and a legend."""

import math

import pygame

from vrg.figures import Shape
from vrg.ui import palette
from vrg.ui.headline import legend
from vrg.ui.scene import Scene
from vrg.ui.view import Projection
from vrg.ui.window import shapes
from vrg.ui.window.easel import draw_sign
from vrg.ui.window.text import Fonts


def strip_height(ui: float) -> int:
    """The height in pixels of the strip below the field."""
    return round(42 * ui)


def draw_strip(surface: pygame.Surface, scene: Scene, view: Projection, ui: float, fonts: Fonts) -> None:
    """Draw the strip at the bottom of a surface; `ui` scales letters."""
    below = pygame.Rect(0, surface.get_height() - strip_height(ui), surface.get_width(), strip_height(ui))
    surface.fill(palette.BACKGROUND, below)
    _scale(surface, view, ui, fonts)
    _signs(surface, scene, ui, fonts)


def legend_left(scene: Scene, width: int, ui: float, fonts: Fonts) -> int:
    """The pixel at which the legend begins in a strip of this many pixels."""
    return _legend(scene, width, ui, fonts)[0]


def _legend(scene: Scene, width: int, ui: float, fonts: Fonts) -> tuple[int, list[tuple[str, tuple[Shape, ...], int]]]:
    """The left end of the legend, and its signs, as many as there is room for, with their words and widths."""
    size, side, gap = max(11, round(13 * ui)), round(16 * ui), round(18 * ui)
    right = width - round(14 * ui)
    signs = [(words, sign, fonts.width(words, size) + side + round(6 * ui)) for words, sign in legend(scene)]
    while signs and sum(each for *_, each in signs) + gap * (len(signs) - 1) > right - 230 * ui:
        signs.pop()
    return right - sum(each for *_, each in signs) - gap * max(0, len(signs) - 1), signs


def _scale(surface: pygame.Surface, view: Projection, ui: float, fonts: Fonts) -> None:
    """Draw a scale in metres and where x and y point."""
    metres = next((m for m in (1, 2, 5, 10, 20, 50, 100) if m * view.scale >= 60 * ui), 100)
    length = metres * view.scale
    left, bottom = 18 * ui, surface.get_height() - 13 * ui
    if surface.get_width() < length + 140 * ui or surface.get_height() < 160 * ui:
        return
    size = max(10, round(12 * ui))
    for start, end in (
        ((left, bottom), (left + length, bottom)),
        ((left, bottom - 4 * ui), (left, bottom + 4 * ui)),
        ((left + length, bottom - 4 * ui), (left + length, bottom + 4 * ui)),
    ):
        shapes.line(surface, start, end, palette.MUTED, 1.5 * ui)
    text = fonts.render(f"{metres} m", size, palette.MUTED)
    surface.blit(text, text.get_rect(midbottom=(left + length / 2, bottom - 3 * ui)))
    origin = (left + length + 40 * ui, bottom - (26 if view.turned else 0) * ui)
    for theta, name in ((0.0, "x"), (math.pi / 2, "y")):
        angle = view.angle(theta)
        tip = shapes.oriented(origin, angle, 15 * ui, 0.0)
        shapes.line(surface, origin, tip, palette.MUTED, 1.5 * ui)
        head = [shapes.oriented(tip, angle, a * ui, b * ui) for a, b in ((5, 0), (-3, 3.5), (-3, -3.5))]
        shapes.polygon(surface, head, palette.MUTED)
        letter = fonts.render(name, size, palette.MUTED)
        surface.blit(letter, letter.get_rect(center=shapes.oriented(origin, angle, 26 * ui, 0.0)))


def _signs(surface: pygame.Surface, scene: Scene, ui: float, fonts: Fonts) -> None:
    """Draw a legend at the right of the strip: the signs of the roles, and what is grey, as far as there is room."""
    size, side, gap = max(11, round(13 * ui)), round(16 * ui), round(18 * ui)
    y = surface.get_height() - strip_height(ui) // 2
    left, signs = _legend(scene, surface.get_width(), ui, fonts)
    for words, sign, width in signs:
        text = fonts.render(words, size, palette.TEXT)
        surface.blit(text, text.get_rect(midleft=(left + side + round(6 * ui), y)))
        draw_sign(surface, sign, (left + side / 2, y), side, ui)
        left += width + gap
