"""Draws a scene upon a surface of any size: field, panel and banners. It can also leave a picture in a file."""

import math
import os
from pathlib import Path
from typing import Final

import pygame

from vrg.ui import palette, shapes
from vrg.ui.banner import Banner, banners
from vrg.ui.field import FieldPainter
from vrg.ui.palette import ink_on
from vrg.ui.panel import PanelPainter
from vrg.ui.scene import Scene
from vrg.ui.text import Face, Fonts
from vrg.ui.view import View

BANNER_LINES: Final = 5
NARROW: Final = 520
"""Pixels; a window narrower than this shows the field alone."""


class Painter:
    """Draws scenes, and keeps the fonts and the unmoving ground between frames."""

    def __init__(self) -> None:
        self._fonts = Fonts()
        self._field = FieldPainter(self._fonts)
        self._panel = PanelPainter(self._fonts)

    def draw(self, surface: pygame.Surface, scene: Scene, driving: str | None = None) -> View:
        """Draw the scene on the whole surface.

        Args:
            driving: the player that the user drives by hand, or None.

        Returns:
            How the field's coordinates became pixels.
        """
        width, height = surface.get_size()
        ui = min(2.5, max(0.8, math.sqrt(width * height / (1280 * 800))))
        panel = round(min(340 * ui, 0.45 * width)) if width >= NARROW else 0
        surface.fill(palette.BACKGROUND)
        area = pygame.Rect(0, 0, max(1, width - panel), max(1, height))
        view = self._field.draw(surface, (*area.topleft, *area.size), scene, ui, driving)
        if panel:
            self._panel.draw(surface, pygame.Rect(width - panel, 0, panel, height), scene, ui, driving)
        _draw_banners(surface, area, scene, self._fonts, ui)
        if driving is not None:
            self._hand(surface, area, driving, ui)
        return view

    def _hand(self, surface: pygame.Surface, area: pygame.Rect, driving: str, ui: float) -> None:
        words = f"You drive {driving}: arrows steer, ESC gives it back"
        size = round(14 * ui)
        words = self._fonts.shorten(words, area.width - round(40 * ui), size, Face.BOLD)
        text = self._fonts.render(words, size, palette.INK, Face.BOLD)
        # In a narrow window it stands above the scale.
        lift = 14 if area.width > 760 * ui else 80
        plate = text.get_rect(midbottom=(area.centerx, area.bottom - round(lift * ui)))
        plate = plate.inflate(round(24 * ui), round(12 * ui))
        shapes.pill(surface, plate, palette.CAUTION, radius=plate.height // 2)
        surface.blit(text, text.get_rect(center=plate.center))


def render_png(scene: Scene, path: Path, size: tuple[int, int] = (1280, 800), driving: str | None = None) -> View:
    """Draw a scene into a PNG file without a window.

    Args:
        size: width and height in pixels.

    Returns:
        How the field's coordinates became pixels.

    Raises:
        OSError: the file cannot be written.
    """
    surface = pygame.Surface(size)
    view = Painter().draw(surface, scene, driving)
    save_png(surface, path)
    return view


def save_png(surface: pygame.Surface, path: Path) -> None:
    """Write a surface to a PNG file.

    Raises:
        OSError: the file cannot be written.
    """
    try:
        pygame.image.save(surface, os.fspath(path))
    except pygame.error as error:
        raise OSError(f"{path}: cannot write the picture: {error}") from None


def _draw_banners(surface: pygame.Surface, area: pygame.Rect, scene: Scene, fonts: Fonts, ui: float) -> None:
    """Draw them below each other at the top of the area."""
    gap = round(10 * ui)
    width = min(area.width - 2 * gap, round(760 * ui))
    y = area.top + gap
    if width < 40:
        return
    for banner in banners(scene):
        place = _draw_banner(surface, pygame.Rect(area.centerx - width // 2, y, width, 0), banner, fonts, ui)
        y = place.bottom + gap


def _draw_banner(surface: pygame.Surface, place: pygame.Rect, banner: Banner, fonts: Fonts, ui: float) -> pygame.Rect:
    pad = round(14 * ui)
    size, step = round(15 * ui), round(21 * ui)
    wrapped = [line for text in banner.lines for line in fonts.wrap(text, place.width - 2 * pad, size, lines=2)]
    if len(wrapped) > BANNER_LINES:
        rest = len(wrapped) - BANNER_LINES + 1
        wrapped = [*wrapped[: BANNER_LINES - 1], f"… and {rest} more"]
    if banner.hint:
        wrapped.append(fonts.shorten(banner.hint, place.width - 2 * pad, size))
    ink = ink_on(banner.colour)
    heading = fonts.render(banner.heading, round(26 * ui), ink, Face.BOLD)
    place.height = heading.get_height() + step * len(wrapped) + 2 * pad - round(4 * ui)
    shapes.pill(surface, place.move(0, round(3 * ui)), (0, 0, 0), 90, 10)
    shapes.pill(surface, place, banner.colour, radius=10)
    surface.blit(heading, heading.get_rect(midtop=(place.centerx, place.top + pad - round(4 * ui))))
    y = place.top + pad + heading.get_height()
    for line in wrapped:
        text = fonts.render(line, size, ink)
        surface.blit(text, text.get_rect(midtop=(place.centerx, y)))
        y += step
    return place
