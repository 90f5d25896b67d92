"""Draws the whole head-up display upon a surface of any size."""

from collections.abc import Sequence
from typing import Final

import pygame

from vrg.ui import palette
from vrg.ui.acts import Act
from vrg.ui.palette import ink_on
from vrg.ui.view import Projection
from vrg.ui.window import shapes
from vrg.ui.window.kit import keys, write
from vrg.ui.window.text import Face, Fonts
from vrg_views.hud import words
from vrg_views.hud.dashboard import Dashboard, Line, alert, player_line, status
from vrg_views.hud.kit import button, field, titled_plate
from vrg_views.hud.layout import BUTTONS, WISHES, Layout, layout
from vrg_views.hud.quadrants import ConesPainter, LocationPainter, PicturePainter, Quadrant, RaysPainter

LINES: Final = 7
"""The lines of the status that are always shown: those before the sensors."""


class HudPainter:
    """Draws dashboards, and keeps the fonts and what stands still between frames."""

    def __init__(self) -> None:
        self._fonts = Fonts()
        self._location = LocationPainter(self._fonts)
        self._quadrants: dict[str, Quadrant] = {
            "laser": RaysPainter(self._fonts), "sonar": ConesPainter(self._fonts), "camera": PicturePainter(self._fonts)
        }  # fmt: skip
        self._kept: dict[str, tuple[object, pygame.Surface]] = {}

    def draw(
        self, surface: pygame.Surface, board: Dashboard, listed: Sequence[tuple[str, str]] = ()
    ) -> tuple[Layout, Projection]:
        """Draw everything, and above it the keys that are listed.

        Returns:
            where everything is, and how the field's coordinates became pixels.
        """
        has = {name: board.seen.first(painter.depiction) is not None for name, painter in self._quadrants.items()}
        places = layout(*surface.get_size(), **has)
        ui = places.ui
        surface.fill(palette.BACKGROUND)
        self._head(surface, places, board)
        view = self._location.draw(surface, places.location, board, ui)
        for name, area in (("laser", places.laser), ("sonar", places.sonar), ("camera", places.camera)):
            if area is not None:
                self._keep(surface, name, area, board, ui)
        self._panel(surface, places, board)
        if listed:
            keys(surface, surface.get_rect(), listed, ui, self._fonts)
        return places, view

    def _keep(self, surface: pygame.Surface, name: str, area: pygame.Rect, board: Dashboard, ui: float) -> None:
        """Draw a quadrant. Readings come less often than frames, so an unchanged one is only copied."""
        place, painter = area.clip(surface.get_rect()), self._quadrants[name]
        key = (tuple(area), surface.get_size(), painter.shows(board))
        before = self._kept.get(name)
        if before is not None and before[0] == key:
            surface.blit(before[1], place)
            return
        painter.draw(surface, area, board, ui)
        self._kept[name] = key, surface.subsurface(place).copy()

    def _head(self, surface: pygame.Surface, places: Layout, board: Dashboard) -> None:
        ui, head, line = places.ui, places.head, alert(board)
        pygame.draw.rect(surface, palette.PANEL, head)
        pad, stop = round(12 * ui), places.buttons[Act.STOP]
        name, size = board.player, round(20 * ui)
        own = pygame.Rect(
            head.left + pad, head.top, min(self._fonts.width(name, size, Face.BOLD), head.width // 4), head.height
        )
        write(surface, name, own, size, palette.TEXT, self._fonts, Face.BOLD)
        who = player_line(board)
        about = pygame.Rect(own.right + pad, head.top, 0, head.height)
        about.width = min(self._fonts.width(who, round(14 * ui)), max(0, head.width // 4))
        write(surface, who, about, round(14 * ui), palette.MUTED, self._fonts)
        plate = pygame.Rect(about.right + pad, stop.top, 0, stop.height)
        plate.width = max(0, stop.left - pad - plate.left)
        shapes.pill(surface, plate, line.colour, radius=round(6 * ui))
        ink = ink_on(line.colour)
        write(surface, line.words, plate.inflate(-2 * pad, 0), round(15 * ui), ink, self._fonts, Face.BOLD)
        button(surface, stop, "STOP", Act.STOP.value[0], palette.ALARM, ui, self._fonts)

    def _panel(self, surface: pygame.Surface, places: Layout, board: Dashboard) -> None:
        ui = places.ui
        titled_plate(surface, places.panel, words.GOTO, "", ui, self._fonts)
        before = surface.get_clip()
        surface.set_clip(places.panel.clip(before))
        for index, ((name, unit), place) in enumerate(zip(words.FIELDS, places.fields, strict=True)):
            focused = board.focus == index
            text = f"{board.texts[index]}{'|' if focused else ''} {unit}"
            field(surface, place, name, text, ui, self._fonts, focused=focused)
        button(surface, places.buttons[Act.TAKE], "Set", Act.TAKE.value[0], palette.RAISED, ui, self._fonts)
        for act, name in BUTTONS.items():
            colour = palette.CAUTION if WISHES.get(act) is board.wish else palette.CALM
            button(surface, places.buttons[act], name, act.value[0], colour, ui, self._fonts)
        self._notice(surface, places.notice, board, ui)
        self._status(surface, places.status, status(board), ui)
        surface.set_clip(before)

    def _notice(self, surface: pygame.Surface, place: pygame.Rect, board: Dashboard, ui: float) -> None:
        """Write the notice for the person, or else what can be done next."""
        size, top = max(12, round(14 * ui)), place.top
        colour = palette.WARNING if board.notice else palette.MUTED
        for line in self._fonts.wrap(board.notice or words.HINTS[board.wish], place.width, size, lines=2):
            text = self._fonts.render(line, size, colour)
            surface.blit(text, (place.left, top))
            top += round(20 * ui)

    def _status(self, surface: pygame.Surface, place: pygame.Rect, lines: list[Line], ui: float) -> None:
        size = max(12, round(14 * ui))
        # Lines of sensors for which there is no room are left out; they are the last ones.
        lines = lines[: max(LINES, place.height // size)]
        row = min(round(30 * ui), place.height // len(lines))
        label = round(100 * ui)
        for index, line in enumerate(lines):
            top = place.top + index * row
            write(
                surface,
                line.label,
                pygame.Rect(place.left, top, label, row),
                max(11, round(12 * ui)),
                palette.MUTED,
                self._fonts,
                Face.BOLD,
            )
            value = pygame.Rect(place.left + label, top, max(1, place.width - label), row)
            write(surface, line.words, value, size, line.colour, self._fonts)
