"""Draws the card that explains a call, over the field."""

from pathlib import Path
from typing import Final

import pygame

from vrg.ui import palette, shapes
from vrg.ui.explaining import Card
from vrg.ui.text import Face, Fonts

BUSY: Final = "working it out …"
CLOSES: Final = "ESC or a click closes this"
_SHARE: Final = 0.92
"""The part of the area that the card may cover, of its width and of its height."""


class CardPainter:
    """Draws cards, and keeps the picture of the last one.

    Args:
        fonts: to write with.
    """

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._loaded: tuple[Path, pygame.Surface | None] | None = None
        self._scaled: tuple[Path, pygame.Surface] | None = None

    def draw(self, surface: pygame.Surface, area: pygame.Rect, card: Card, ui: float) -> pygame.Rect:
        """Draw a card in the middle of an area, and return where it is."""
        pad, size = round(16 * ui), round(13 * ui)
        width = round(_SHARE * area.width)
        room = width - 2 * pad
        heading = self._fonts.wrap(card.heading, room, round(16 * ui), Face.BOLD, lines=2)
        lines = [
            part
            for line in (*card.lines, *([BUSY] if card.busy else ()))
            for part in self._fonts.wrap(line, room, size)
        ]
        step = round(1.4 * size)
        words = round(22 * ui) * len(heading) + step * (len(lines) + 1) + round(10 * ui)
        most = round(_SHARE * area.height)
        picture = self._picture(card.picture, room, most - words - 3 * pad)
        height = min(most, words + 2 * pad + (picture.get_height() + pad if picture is not None else 0))
        plate = pygame.Rect(0, 0, width, height)
        plate.center = area.center
        shapes.pill(surface, plate, palette.PANEL, 248, 10)
        pygame.draw.rect(surface, palette.LINE, plate, 1, border_radius=10)
        before = surface.get_clip()
        surface.set_clip(plate.clip(before))
        x, y = plate.left + pad, plate.top + pad
        for line in heading:
            surface.blit(self._fonts.render(line, round(16 * ui), palette.TEXT, Face.BOLD), (x, y))
            y += round(22 * ui)
        for line in lines:
            surface.blit(self._fonts.render(line, size, palette.TEXT), (x, y))
            y += step
        if picture is not None:
            surface.blit(picture, picture.get_rect(midtop=(plate.centerx, y + round(6 * ui))))
        hint = self._fonts.render(CLOSES, round(11 * ui), palette.MUTED)
        surface.blit(hint, hint.get_rect(bottomright=(plate.right - pad, plate.bottom - pad // 2)))
        surface.set_clip(before)
        return plate

    def _picture(self, path: Path | None, width: int, height: int) -> pygame.Surface | None:
        """The picture, as large as there is room; None if there is none, or no room."""
        if path is None or height < 60:
            return None
        if self._loaded is None or self._loaded[0] != path:
            try:
                self._loaded = path, pygame.image.load(path)
            except (OSError, pygame.error):
                self._loaded = path, None
            self._scaled = None
        whole = self._loaded[1]
        if whole is None:
            return None
        scale = min(width / whole.get_width(), height / whole.get_height())
        wanted = (max(1, round(whole.get_width() * scale)), max(1, round(whole.get_height() * scale)))
        if self._scaled is None or self._scaled[1].get_size() != wanted:
            self._scaled = path, pygame.transform.smoothscale(whole, wanted)
        return self._scaled[1]
