"""Draws the list of players: who each is, what it does, how fast it is, and what is wrong with it."""

from dataclasses import dataclass
from typing import Final

import pygame

from vrg.colours import Rgb, mix
from vrg.games import look
from vrg.games.game import Game
from vrg.ui import palette
from vrg.ui.deeds import deed
from vrg.ui.scene import Scene, ScenePlayer, speed_text
from vrg.ui.window import shapes
from vrg.ui.window.easel import draw_sign
from vrg.ui.window.text import Face, Fonts

PHYSICAL_RIM: Final = 2
"""Pixels of white around the badge of a player with a physical robot, as around its body."""
_ROW: Final = 24
"""The height of a row where there is room, in pixels at the usual size of a window."""
_MIN_ROW_HEIGHT: Final = 18
"""The height below which rows are not made any lower; the list then has two columns, and tells no speeds."""
_WIDE: Final = (0.10, 0.42)
_HALF: Final = (0.16, 0.60)
"""The begin of the name and of the deed in a row of one column and of two, as parts of its width."""
_SMALLEST: Final = 0.75
"""By how much the letters of a long name are made smaller at most."""
_SPEED: Final = 0.22
"""The part of the width that the speed has in a row of one column."""


@dataclass(frozen=True)
class _Row:
    """One row of the list.

    Args:
        place: its rectangle in pixels. driven: its player is driven by the user of this window.
        physical: its player has a physical robot. brief: it is half as wide, and tells only name and deed.
    """

    place: pygame.Rect
    driven: bool
    physical: bool
    brief: bool


class RosterPainter:
    """Draws the list from the top of an area down."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts

    def draw(
        self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, game: Game, ui: float, driving: str | None
    ) -> int:
        """Draw the players of a scene; `driving` is the one that the user drives by hand.

        Returns:
            the y below the list. Faults may need more than the area.
        """
        physical = {body.name for body in scene.bodies if body.physical}
        columns = 1 if area.height / len(scene.players) >= _MIN_ROW_HEIGHT * ui else 2
        rows = -(-len(scene.players) // columns)
        height = round(min(_ROW * ui, max(_MIN_ROW_HEIGHT * ui, area.height / rows)))
        gap = round(14 * ui)
        width = (area.width - gap * (columns - 1)) // columns
        y = area.top
        for index, player in enumerate(scene.players):
            column, row = divmod(index, rows)
            if columns == 2:
                y = area.top + row * height
            place = pygame.Rect(area.left + column * (width + gap), y, width, height)
            shown = _Row(place, player.name == driving, player.name in physical, brief=columns == 2)
            self._row(surface, shown, player, game, ui)
            y = place.bottom
            if columns == 1:
                y = self._fault(surface, place, player.fault, ui)
        if columns == 2:
            y = area.top + rows * height
            for player in scene.players:
                place = pygame.Rect(area.left, y, area.width, 0)
                y = self._fault(surface, place, f"{player.name}: {player.fault}" if player.fault else None, ui, lines=1)
        return y

    def _row(self, surface: pygame.Surface, row: _Row, player: ScenePlayer, game: Game, ui: float) -> None:
        place, style = row.place, game.style(player.role, player.state)
        if row.driven:
            back = place.inflate(round(12 * ui), 0)
            shapes.pill(surface, back, mix(palette.PANEL, palette.CAUTION, 0.22), radius=6)
        badge = pygame.Rect(0, 0, round(18 * ui), round(18 * ui))
        badge.height = badge.width = min(badge.width, place.height - round(2 * ui))
        badge.center = (place.left + badge.width // 2, place.centery)
        if row.physical:
            shapes.pill(surface, badge.inflate(2 * PHYSICAL_RIM, 2 * PHYSICAL_RIM), palette.TEXT, radius=6)
        draw_sign(surface, look.badge(style), badge.center, badge.width, ui)
        quiet = player.out_of_play
        name = (player.name, Face.BOLD, palette.CAUTION if player.fault else palette.MUTED if quiet else palette.TEXT)
        words, colour = deed(player, driven=row.driven, brief=row.brief)
        doing = (words, Face.REGULAR, colour)
        speed = not row.brief and not quiet and player.speed is not None
        cells, begins = (name, doing), _HALF if row.brief else _WIDE
        last = 1.0 - _SPEED if speed else 1.0
        size = round((12 if row.brief else 13) * ui)
        for (words, face, colour), begin, end in zip(cells, begins, (*begins[1:], last), strict=True):
            room = round(place.width * (end - begin)) - round((2 if row.brief else 6) * ui)
            text = self._cell(words, room, size, colour, face, name=begin == begins[0])
            surface.blit(text, text.get_rect(midleft=(place.left + round(place.width * begin), place.centery)))
        if speed and player.speed is not None:
            plate = self._fonts.render(f"{speed_text(player.speed)} m/s", round(12 * ui), palette.MUTED)
            surface.blit(plate, plate.get_rect(midright=(place.right, place.centery)))

    def _cell(self, words: str, room: int, size: int, colour: Rgb, face: Face, *, name: bool) -> pygame.Surface:
        """Write a cell. A name is written smaller before it is shortened, and keeps its end: there its number is."""
        if not name:
            return self._fonts.render(self._fonts.shorten(words, room, size, face), size, colour, face)
        smaller = next(
            (s for s in range(size, round(_SMALLEST * size), -1) if self._fonts.width(words, s, face) <= room), None
        )
        if smaller is None:
            smaller = round(_SMALLEST * size)
            words = self._fonts.shorten_middle(words, room, smaller, face)
        return self._fonts.render(words, smaller, colour, face)

    def _fault(
        self, surface: pygame.Surface, place: pygame.Rect, fault: str | None, ui: float, *, lines: int = 3
    ) -> int:
        """Write what is wrong below a row; the y below it."""
        y = place.bottom
        if fault:
            size, indent = round(11 * ui), round(place.width * _WIDE[0])
            for line in self._fonts.wrap(fault, place.width - indent, size, lines=lines):
                surface.blit(self._fonts.render(line, size, palette.CAUTION), (place.left + indent, y))
                y += round(15 * ui)
        return y
