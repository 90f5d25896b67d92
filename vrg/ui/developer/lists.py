"""Draws tables and lists into an area, and tells what is where."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import pygame

from vrg.bus.messages import Call
from vrg.colours import Rgb
from vrg.games.game import Style
from vrg.ui import kit, palette, shapes
from vrg.ui.developer.tables import Column, Grid, Item, Tone
from vrg.ui.text import Fonts

TONES: Final = {
    Tone.QUIET: palette.MUTED,
    Tone.PLAIN: palette.TEXT,
    Tone.GOOD: palette.mix(palette.SAFE, palette.TEXT, 0.35),
    Tone.CAUTION: palette.CAUTION,
    Tone.ALARM: palette.WARNING,
}
"""The colour of what is written, by how urgent it is."""
_LABEL: Final = 0.25
"""The part of the width of a list that its labels have."""


@dataclass(frozen=True)
class HitArea:
    """The place of a heading of a table, of the name of a row, or of a call."""

    area: pygame.Rect
    heading: str = ""
    name: str = ""
    call: Call | None = None


class ListPainter:
    """Draws tables and lists.

    Args:
        fonts: to write with.
    """

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts

    def grid(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        grid: Grid,
        row: int,
        ui: float,
        *,
        first: int = 0,
        marked: str | None = None,
        sort: tuple[str, bool] | None = None,
        styles: Mapping[str, Style] = {},
    ) -> list[HitArea]:
        """Draw a table from its row `first` on, as far as there is room.

        Args:
            row: the height of a row, pixels. marked: the name of the row that is marked.
            sort: the heading that the rows are sorted by, and whether downwards.
            styles: the badges that stand before the rows of these names.
        """
        size = max(9, min(round(12 * ui), round(0.72 * row)))
        badge = row if styles else 0
        places = []
        for column, cell in self._cells(area.left + badge, area.width - badge, area.top, row, grid.columns):
            sign = "" if sort is None or sort[0] != column.heading else " ▾" if sort[1] else " ▴"
            self._write(surface, cell, column.heading + sign, max(9, size - 1), palette.MUTED, right=column.right)
            places.append(HitArea(cell, heading=column.heading))
        pygame.draw.line(surface, palette.LINE, (area.left, area.top + row - 1), (area.right, area.top + row - 1))
        visible = grid.lines[first : first + self.rows(area, row)]
        for index, line in enumerate(visible):
            place = pygame.Rect(area.left, area.top + (index + 1) * row, area.width, row)
            if line.name and line.name == marked:
                shapes.pill(surface, place, palette.RAISED, radius=4)
            style = styles.get(line.name)
            if style is not None:
                self._badge(surface, place, style)
            cells = self._cells(place.left + badge, area.width - badge, place.top, row, grid.columns)
            for (column, box), content in zip(cells, line.cells, strict=True):
                self._write(surface, box, content.text, size, TONES[content.tone], right=column.right)
            if line.name:
                places.append(HitArea(place, name=line.name))
        self._more(surface, area, first, len(grid.lines) - first - len(visible))
        return places

    @staticmethod
    def rows(area: pygame.Rect, row: int) -> int:
        """The number of rows of a table that have room below its headings."""
        return max(0, area.height // max(1, row) - 1)

    def items(
        self, surface: pygame.Surface, area: pygame.Rect, items: Sequence[Item], ui: float, *, first: int = 0
    ) -> list[HitArea]:
        """Draw a list from its item `first` on, as far as there is room; long items have several lines."""
        size, step = max(10, round(12.5 * ui)), round(17 * ui)
        indent = round(_LABEL * area.width) if any(len(item.label) > 8 for item in items) else round(58 * ui)
        y, places, shown = area.top, [], 0
        for item in items[first:]:
            top = y
            if item.heading:
                y += round(4 * ui) if y > area.top else 0
                if y + step > area.bottom:
                    break
                kit.heading(surface, pygame.Rect(area.left, y, area.width, step), item.text, ui, self._fonts)
                y += step
            else:
                left = area.left + (indent if item.label else 0)
                lines = self._fonts.wrap(item.text, area.right - left, size) or [""]
                if y + step * len(lines) > area.bottom:
                    break
                if item.label:
                    label = self._fonts.shorten(item.label, indent - round(6 * ui), max(10, round(11.5 * ui)))
                    text = self._fonts.render(label, max(10, round(11.5 * ui)), palette.MUTED)
                    surface.blit(text, (area.left, y + 1))
                for words in lines:
                    surface.blit(self._fonts.render(words, size, TONES[item.tone]), (left, y))
                    y += step
            shown += 1
            if item.call is not None:
                places.append(HitArea(pygame.Rect(area.left, top, area.width, y - top), call=item.call))
        self._more(surface, area, first, len(items) - first - shown)
        return places

    def line(self, surface: pygame.Surface, area: pygame.Rect, text: str, size: int, tone: Tone = Tone.QUIET) -> None:
        """Write one line at the left of an area, as far as there is room."""
        self._write(surface, area, text, size, TONES[tone], right=False)

    def _cells(
        self, left: int, width: int, top: int, row: int, columns: Sequence[Column]
    ) -> list[tuple[Column, pygame.Rect]]:
        found, share = [], 0.0
        for column in columns:
            begin, share = share, share + column.share
            room = round(column.share * width) - width // 50
            found.append((column, pygame.Rect(left + round(begin * width), top, max(1, room), row)))
        return found

    def _write(
        self,
        surface: pygame.Surface,
        area: pygame.Rect,
        text: str,
        size: int,
        colour: Rgb,
        *,
        right: bool,
    ) -> None:
        if not text:
            return
        shown = self._fonts.render(self._fonts.shorten(text, area.width, size), size, colour)
        place = shown.get_rect(midright=area.midright) if right else shown.get_rect(midleft=area.midleft)
        surface.blit(shown, place)

    @staticmethod
    def _badge(surface: pygame.Surface, place: pygame.Rect, style: Style) -> None:
        side = max(6, place.height - 5)
        badge = pygame.Rect(0, 0, side, side)
        badge.midleft = (place.left + 1, place.centery)
        shapes.pill(surface, badge, style.colour, radius=3)
        shapes.marker(surface, badge.center, 1.5708, side * 0.32, palette.INK, style.marker)

    @staticmethod
    def _more(surface: pygame.Surface, area: pygame.Rect, above: int, below: int) -> None:
        """Show at the right edge that there is more above or below: the wheel brings it."""
        x = area.right + 5
        if above > 0:
            pygame.draw.polygon(surface, palette.MUTED, [(x, area.top), (x - 4, area.top + 6), (x + 4, area.top + 6)])
        if below > 0:
            low = area.bottom
            pygame.draw.polygon(surface, palette.MUTED, [(x, low), (x - 4, low - 6), (x + 4, low - 6)])
