"""Draws a scene upon a surface of any size: head, field and panel."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Protocol

import pygame

from vrg.bus.messages import Stage
from vrg.games import game_of
from vrg.ui import palette
from vrg.ui.banner import Help
from vrg.ui.scene import Scene
from vrg.ui.view import Projection
from vrg.ui.window import kit, shapes
from vrg.ui.window.card import CardPainter
from vrg.ui.window.explaining import Card
from vrg.ui.window.field import FieldPainter
from vrg.ui.window.ground import legend_left, strip_height
from vrg.ui.window.header import HEIGHT, HeaderPainter, ResultPainter
from vrg.ui.window.panel import PanelPainter
from vrg.ui.window.text import Face, Fonts

SMALLEST_UI: Final = 0.9
"""By how much letters are scaled at least; 1 is their size at 1280 by 800 pixels."""
NO_PLANS: Final = "No player shows a plan now: plans are drawn when one does"
PLANS_HIDDEN: Final = "Plans are hidden"
NARROW: Final = 520
"""Pixels; a window narrower than this shows the field alone."""


class Panel(Protocol):
    """A panel beside the field."""

    def draw(self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, ui: float, driving: str | None) -> None:
        """Draw it into an area; `ui` scales letters, `driving` is the player that the user drives by hand."""


class Painter:
    """Draws scenes, and keeps the fonts and the unmoving ground between frames.

    Args:
        fonts: to write with. panel: what is drawn beside the field; the spectator's if it is None.
        panel_width: the width of the panel, pixels at the usual size of a window.
        help_: how those who look at the window can help. plans: whether what players sketch of their plans
            is shown; None leaves that to the game until somebody switches it.
    """

    def __init__(
        self,
        fonts: Fonts | None = None,
        panel: Panel | None = None,
        *,
        panel_width: int = 300,
        help_: Help = Help.NONE,
        plans: bool | None = None,
    ) -> None:
        self.plans = plans
        self._fonts = fonts or Fonts()
        self._field = FieldPainter(self._fonts)
        self._panel = panel or PanelPainter(self._fonts)
        self._panel_width = panel_width
        self._header = HeaderPainter(self._fonts, help_)
        self._result = ResultPainter(self._fonts)
        self._card = CardPainter(self._fonts)

    def switch_plans(self, scene: Scene) -> str:
        """Show what players sketch of their plans, or not any more; return what to tell where that cannot be seen."""
        self.plans = not self._shows_plans(scene)
        return "" if scene.strokes else NO_PLANS if self.plans else PLANS_HIDDEN

    def _shows_plans(self, scene: Scene) -> bool:
        return game_of(scene.game).plans if self.plans is None else self.plans

    def draw(
        self,
        surface: pygame.Surface,
        scene: Scene,
        driving: str | None = None,
        *,
        hand: str = "",
        keys: Sequence[tuple[str, str]] = (),
        card: Card | None = None,
        over: str = "",
    ) -> Projection:
        """Draw the scene on the whole surface.

        Args:
            driving: the player that the user drives by hand, or None. hand: what the user must read of that.
            keys: those to list over the field, with their meanings.
            card: why a call was made, which is shown over the field; None shows nothing.
            over: what the user can do once the game is over, which is shown with its result; empty shows no result.

        Returns:
            How the field's coordinates became pixels.
        """
        width, height = surface.get_size()
        ui = letter_scale(width, height)
        panel = round(min(self._panel_width * ui, 0.45 * width)) if width >= NARROW else 0
        top = min(round(HEIGHT * ui), height // 3)
        surface.fill(palette.BACKGROUND)
        area = pygame.Rect(0, top, max(1, width - panel), max(1, height - top))
        shown = scene if self._shows_plans(scene) else replace(scene, strokes=())
        view = self._field.draw(surface, area, shown, ui, driving)
        self._result.remember(surface, area, scene, ui)
        if panel:
            self._panel.draw(surface, pygame.Rect(width - panel, top, panel, height - top), scene, ui, driving)
        # One thing lies over the field: the keys, or else a card, or else the result.
        result = card is None and not keys and bool(over) and scene.stage is Stage.GAME_OVER
        if card is not None and not keys:
            self._card.draw(surface, area, card, ui, turned=view.turned)
        elif result:
            self._result.draw(surface, area, scene, over, ui)
        # Nothing covers what must be seen.
        self._header.draw(surface, pygame.Rect(0, 0, width, top), scene, ui, result=not result)
        if keys:
            kit.keys(surface, area, keys, ui, self._fonts)
        if hand:
            self._hand(surface, area, hand, legend_left(scene, area.width, ui, self._fonts), ui)
        return view

    def _hand(self, surface: pygame.Surface, area: pygame.Rect, words: str, right: int, ui: float) -> None:
        """Write what the user must read between the scale and the legend, which begins at `right`, or above them."""
        size = round(14 * ui)
        words = self._fonts.shorten(words, area.width - round(40 * ui), size, Face.BOLD)
        text = self._fonts.render(words, size, palette.INK, Face.BOLD)
        plate = text.get_rect().inflate(round(24 * ui), round(12 * ui))
        strip = strip_height(ui)
        between = pygame.Rect(round(190 * ui), area.bottom - strip, right - round(12 * ui) - round(190 * ui), strip)
        if plate.width <= between.width:
            plate.center = (area.centerx, between.centery)
            plate.clamp_ip(between)
        else:
            plate.midbottom = (area.centerx, between.top - round(4 * ui))
        shapes.pill(surface, plate, palette.CAUTION, radius=plate.height // 2)
        surface.blit(text, text.get_rect(center=plate.center))


def letter_scale(width: int, height: int) -> float:
    """By how much letters are scaled in a window of this many pixels; 1 is their size at 1280 by 800 pixels."""
    return min(4.0, max(SMALLEST_UI, math.sqrt(width * height / (1280 * 800))))


class Still:
    """Draws scenes as the spectator's window shows them. It needs no display.

    Args:
        size: of the pictures, pixels.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._surface = pygame.Surface(size)
        self._painter = Painter()

    def rgb(self, scene: Scene) -> bytes:
        """Draw a scene, and return the red, green and blue of each pixel, row by row from the top."""
        self._painter.draw(self._surface, scene)
        return pygame.image.tobytes(self._surface, "RGB")
