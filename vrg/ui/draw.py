"""Draws a scene upon a surface of any size: field, panel and banners."""

import math
from collections.abc import Sequence
from typing import Final, Protocol

import pygame

from vrg.ui import kit, palette, shapes
from vrg.ui.banner import Banner, banners
from vrg.ui.card import CardPainter
from vrg.ui.explaining import Card
from vrg.ui.field import FieldPainter
from vrg.ui.ground import strip_height
from vrg.ui.palette import ink_on
from vrg.ui.panel import PanelPainter
from vrg.ui.scene import Scene
from vrg.ui.text import Face, Fonts
from vrg.ui.view import View

BANNER_LINES: Final = 5
SMALLEST_UI: Final = 0.9
"""By how much letters are scaled at least; 1 is their size at 1280 by 800 pixels."""
NARROW: Final = 520
"""Pixels; a window narrower than this shows the field alone."""


class Panel(Protocol):
    """What is drawn beside the field."""

    def draw(self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, ui: float, driving: str | None) -> None:
        """Draw it into an area; `ui` scales letters, `driving` is the player that the user drives by hand."""


class Painter:
    """Draws scenes, and keeps the fonts and the unmoving ground between frames.

    Args:
        fonts: to write with. panel: what is drawn beside the field; the spectator's if it is None.
        panel_width: the width of the panel, pixels at the usual size of a window.
        hints: False if the keys that banners name have no meaning in this window.
    """

    def __init__(
        self, fonts: Fonts | None = None, panel: Panel | None = None, *, panel_width: int = 340, hints: bool = True
    ) -> None:
        self._fonts = fonts or Fonts()
        self._field = FieldPainter(self._fonts)
        self._panel = panel or PanelPainter(self._fonts)
        self._panel_width = panel_width
        self._banners = BannerPainter(self._fonts, hints=hints)
        self._card = CardPainter(self._fonts)

    def draw(
        self,
        surface: pygame.Surface,
        scene: Scene,
        driving: str | None = None,
        *,
        hand: str = "",
        keys: Sequence[tuple[str, str]] = (),
        card: Card | None = None,
    ) -> View:
        """Draw the scene on the whole surface.

        Args:
            driving: the player that the user drives by hand, or None. hand: what the user must read of that.
            keys: those to list over the field, with their meanings.
            card: why a call was made, which is shown over the field; None shows nothing.

        Returns:
            How the field's coordinates became pixels.
        """
        width, height = surface.get_size()
        ui = scale_of(width, height)
        panel = round(min(self._panel_width * ui, 0.45 * width)) if width >= NARROW else 0
        surface.fill(palette.BACKGROUND)
        area = pygame.Rect(0, 0, max(1, width - panel), max(1, height))
        top = min(self._banners.height(area, scene, ui), area.height // 2)
        calm = self._banners.calm_height(ui)
        view = self._field.draw(
            surface,
            (area.left, top, area.width, area.height - top),
            scene,
            ui,
            driving,
            whole=(area.left, calm, area.width, area.height - calm),
        )
        if panel:
            self._panel.draw(surface, pygame.Rect(width - panel, 0, panel, height), scene, ui, driving)
        if card is not None:
            self._card.draw(surface, area, card, ui)
        # Nothing covers what must be seen.
        self._banners.draw(surface, area, scene, ui)
        if keys:
            kit.keys(surface, area, keys, ui, self._fonts)
        if hand:
            self._hand(surface, area, hand, ui)
        return view

    def _hand(self, surface: pygame.Surface, area: pygame.Rect, words: str, ui: float) -> None:
        size = round(14 * ui)
        words = self._fonts.shorten(words, area.width - round(40 * ui), size, Face.BOLD)
        text = self._fonts.render(words, size, palette.INK, Face.BOLD)
        plate = text.get_rect().inflate(round(24 * ui), round(12 * ui))
        # Right of the scale, in the strip below the field; in a narrow window upon the scale.
        right = area.right - round(12 * ui)
        plate.midright = (min(right, area.centerx + plate.width // 2), area.bottom - strip_height(ui) // 2)
        plate.left = max(plate.left, min(round(190 * ui), right - plate.width))
        shapes.pill(surface, plate, palette.CAUTION, radius=plate.height // 2)
        surface.blit(text, text.get_rect(center=plate.center))


def scale_of(width: int, height: int) -> float:
    """By how much letters are scaled in a window of so many pixels; 1 is their size at 1280 by 800 pixels."""
    return min(2.5, max(SMALLEST_UI, math.sqrt(width * height / (1280 * 800))))


class BannerPainter:
    """Draws the banners below each other at the top of an area. They have it for themselves: no robot is below them.

    Args:
        fonts: to write with. hints: whether they tell which keys help.
    """

    def __init__(self, fonts: Fonts, *, hints: bool = True) -> None:
        self._fonts = fonts
        self._hints = hints

    def height(self, area: pygame.Rect, scene: Scene, ui: float) -> int:
        """The height in pixels that is kept for them, which is that of a brief one where there is none."""
        gap = round(10 * ui)
        heights = [self._place(area, banner, ui).height for banner in banners(scene)]
        return max(sum(heights) + gap * (len(heights) + 1), self.calm_height(ui))

    def calm_height(self, ui: float) -> int:
        """The height in pixels that is kept where there is none."""
        return self._brief_height(ui) + 2 * round(10 * ui)

    def draw(self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, ui: float) -> None:
        """Draw the banners of a scene."""
        y = area.top + round(10 * ui)
        for banner in banners(scene):
            place = self._place(area, banner, ui).move(0, y)
            if place.width < 40:
                return
            self._draw_one(surface, place, banner, ui)
            y = place.bottom + round(10 * ui)

    @staticmethod
    def _brief_height(ui: float) -> int:
        return round(34 * ui)

    def _place(self, area: pygame.Rect, banner: Banner, ui: float) -> pygame.Rect:
        """Where a banner is, but for its top."""
        width = min(area.width - round(20 * ui), round(760 * ui))
        if banner.brief:
            height = self._brief_height(ui)
        else:
            heading = self._fonts.render(banner.heading, round(26 * ui), palette.INK, Face.BOLD).get_height()
            height = heading + round(21 * ui) * len(self._lines(banner, width, ui)) + round(24 * ui)
        return pygame.Rect(area.centerx - width // 2, 0, width, height)

    def _lines(self, banner: Banner, width: int, ui: float) -> list[str]:
        size, room = round(15 * ui), width - round(28 * ui)
        wrapped = [line for text in banner.lines for line in self._fonts.wrap(text, room, size, lines=2)]
        if len(wrapped) > BANNER_LINES:
            rest = len(wrapped) - BANNER_LINES + 1
            wrapped = [*wrapped[: BANNER_LINES - 1], f"… and {rest} more"]
        hinted = self._hints and banner.hint
        return [*wrapped, self._fonts.shorten(banner.hint, room, size)] if hinted else wrapped

    def _draw_one(self, surface: pygame.Surface, place: pygame.Rect, banner: Banner, ui: float) -> None:
        shapes.pill(surface, place.move(0, round(3 * ui)), (0, 0, 0), 90, 10)
        shapes.pill(surface, place, banner.colour, radius=10)
        ink, size = ink_on(banner.colour), round(15 * ui)
        if banner.brief:
            more = f" and {len(banner.lines) - 1} more" if len(banner.lines) > 1 else ""
            words = f"{banner.heading}: {banner.lines[0] if banner.lines else ''}"
            room = place.width - round(28 * ui) - self._fonts.render(more, size, ink).get_width()
            text = self._fonts.render(self._fonts.shorten(words, room, size) + more, size, ink)
            surface.blit(text, text.get_rect(center=place.center))
            return
        heading = self._fonts.render(banner.heading, round(26 * ui), ink, Face.BOLD)
        surface.blit(heading, heading.get_rect(midtop=(place.centerx, place.top + round(10 * ui))))
        y = place.top + round(14 * ui) + heading.get_height()
        for line in self._lines(banner, place.width, ui):
            text = self._fonts.render(line, size, ink)
            surface.blit(text, text.get_rect(midtop=(place.centerx, y)))
            y += round(21 * ui)
