"""Draws the card that explains a call, over the field."""

from typing import Final

import pygame

from vrg.ui import palette
from vrg.ui.plots.proof import ProofPainter
from vrg.ui.window import kit
from vrg.ui.window.explaining import Card
from vrg.ui.window.text import Face, Fonts

BUSY: Final = "working it out …"
CLOSES: Final = "ESC or a click closes this"
_SHARE: Final = 0.92
"""The part of the area that the card may cover, of its width and of its height."""


class CardPainter:
    """Draws cards.

    Args:
        fonts: to write with.
    """

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._proof = ProofPainter(fonts)

    def draw(
        self, surface: pygame.Surface, area: pygame.Rect, card: Card, ui: float, *, turned: bool | None = None
    ) -> pygame.Rect:
        """Draw a card in the middle of an area, and return where it is.

        Args:
            turned: whether the window shows the field a quarter turn clockwise.
        """
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
        tall = most - words - 3 * pad
        shown = card.proof is not None and tall >= 60
        picture = self._proof.picture(card.proof, (room, tall), ui, turned=turned) if shown and card.proof else None
        height = min(most, words + 2 * pad + (picture.get_height() + pad if picture is not None else 0))
        plate = pygame.Rect(0, 0, width, height)
        plate.center = area.center
        kit.plate(surface, plate, ui)
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
