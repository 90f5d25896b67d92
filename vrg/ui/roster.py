"""Draws the list of players: who each is, what it does, and what is wrong with it."""

from typing import Final

import pygame

from vrg.bus.messages import DISQUALIFIED
from vrg.games.game import Game
from vrg.ui import palette, shapes
from vrg.ui.scene import Scene, ScenePlayer
from vrg.ui.text import Face, Fonts

PHYSICAL_RIM: Final = 2
"""Pixels of white around the badge of a player with a physical robot, as around its body."""
_ROW: Final = 24
"""The height of a row where there is room, in pixels at the usual size of a window."""
_LEAST: Final = 18
"""The height below which rows are not made any lower; the list then has two columns, and tells no roles."""
_WIDE: Final = (0.10, 0.42, 0.62)
_HALF: Final = (0.16, 0.66)
"""Where the cells of a row begin, as parts of its width: name, role, deed; or name and deed."""


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
        columns = 1 if area.height / len(scene.players) >= _LEAST * ui else 2
        rows = -(-len(scene.players) // columns)
        height = round(min(_ROW * ui, max(_LEAST * ui, area.height / rows)))
        width = (area.width - round(14 * ui) * (columns - 1)) // columns
        y = area.top
        for index, player in enumerate(scene.players):
            column, row = divmod(index, rows)
            if columns == 2:
                y = area.top + row * height
            place = pygame.Rect(area.left + column * (width + round(14 * ui)), y, width, height)
            driven = player.name == driving
            self._row(
                surface, place, player, game, ui, driven=driven, physical=player.name in physical, brief=columns == 2
            )
            y = place.bottom
            if columns == 1:
                y = self._fault(surface, place, player.fault, ui)
        if columns == 2:
            y = area.top + rows * height
            for player in scene.players:
                place = pygame.Rect(area.left, y, area.width, 0)
                y = self._fault(surface, place, f"{player.name}: {player.fault}" if player.fault else None, ui, lines=1)
        return y

    def _row(
        self,
        surface: pygame.Surface,
        place: pygame.Rect,
        player: ScenePlayer,
        game: Game,
        ui: float,
        *,
        driven: bool,
        physical: bool,
        brief: bool,
    ) -> None:
        if driven:
            back = place.inflate(round(12 * ui), 0)
            shapes.pill(surface, back, palette.mix(palette.PANEL, palette.CAUTION, 0.22), radius=6)
        style = game.style(player.role, player.state)
        badge = pygame.Rect(0, 0, round(18 * ui), round(18 * ui))
        badge.height = badge.width = min(badge.width, place.height - round(2 * ui))
        badge.center = (place.left + badge.width // 2, place.centery)
        if physical:
            shapes.pill(surface, badge.inflate(2 * PHYSICAL_RIM, 2 * PHYSICAL_RIM), palette.TEXT, radius=6)
        shapes.pill(surface, badge, style.colour, radius=4)
        shapes.marker(surface, badge.center, 1.5708, badge.width * 0.32, palette.INK, style.marker)
        quiet = player.out_of_play
        does = player.state if quiet else player.mode.rpartition("/")[2] or player.state
        deed = "by hand" if driven or player.manual else "out" if brief and player.state == DISQUALIFIED else does
        name = (player.name, Face.BOLD, palette.CAUTION if player.fault else palette.MUTED if quiet else palette.TEXT)
        role = (player.role, Face.REGULAR, style.colour if not quiet else palette.MUTED)
        act = (deed, Face.REGULAR, palette.CAUTION if deed == "by hand" else palette.MUTED)
        cells, begins = ((name, act), _HALF) if brief else ((name, role, act), _WIDE)
        size = round((12 if brief else 13) * ui)
        for (words, face, colour), begin, end in zip(cells, begins, (*begins[1:], 1.0), strict=True):
            room = round(place.width * (end - begin)) - round((2 if brief else 6) * ui)
            text = self._fonts.render(self._fonts.shorten(words, room, size, face), size, colour, face)
            surface.blit(text, text.get_rect(midleft=(place.left + round(place.width * begin), place.centery)))

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
