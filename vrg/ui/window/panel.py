"""Draws the panel beside the field: the things of the game, the players and the referee's calls, which scroll."""

from typing import Final

import pygame
from pygame import Rect

from vrg.bus.messages import Call
from vrg.figures import ORIGIN
from vrg.games import UNKNOWN_GAME, game_of, look
from vrg.ui import palette
from vrg.ui.scene import Scene, clock_text
from vrg.ui.window import kit
from vrg.ui.window.easel import draw_sign
from vrg.ui.window.roster import RosterPainter
from vrg.ui.window.text import Face, Fonts

_PLAYERS_SHARE: Final = 0.55
"""The part of the panel's height that the list of players may have."""


class PanelPainter:
    """Draws the panel into a rectangle from the top down. Whatever has no room is left out.

    Args:
        fonts: to write with.

    Attributes:
        first: the number of the call that stands on top, from the newest, which is 0.
    """

    def __init__(self, fonts: Fonts) -> None:
        self.first = 0
        self._fonts = fonts
        self._roster = RosterPainter(fonts)
        self._game = UNKNOWN_GAME
        self._area = Rect(0, 0, 0, 0)
        self._shown: list[tuple[Rect, Call]] = []
        self._count = 0

    def draw(self, surface: pygame.Surface, area: Rect, scene: Scene, ui: float, driving: str | None) -> None:
        """Draw the scene's words; `ui` scales letters, `driving` is the player that the user drives by hand."""
        pygame.draw.rect(surface, palette.PANEL, area)
        pygame.draw.line(surface, palette.LINE, area.topleft, area.bottomleft)
        before = surface.get_clip()
        surface.set_clip(area.clip(before))
        self._game = game_of(scene.game)
        self._area = area
        pad = round(14 * ui)
        inside = area.inflate(-2 * pad, -2 * pad)
        hint = self._fonts.render("? shows the keys", round(12 * ui), palette.MUTED)
        inside.height -= hint.get_height() + pad // 2
        surface.blit(hint, (inside.left, inside.bottom + pad // 2))
        self._objects(surface, inside, scene, ui)
        self._players(surface, inside, scene, ui, driving)
        self._calls(surface, inside, scene, ui)
        surface.set_clip(before)

    def call_at(self, place: tuple[int, int]) -> Call | None:
        """The call that is written at a pixel of the window; None if there is none."""
        return next((call for area, call in self._shown if area.collidepoint(place)), None)

    def scroll(self, place: tuple[int, int], steps: int) -> None:
        """Scroll the calls by so many, to older ones if they are positive, if a pixel is on the panel."""
        if self._area.collidepoint(place):
            self.first = min(max(0, self.first + steps), max(0, self._count - 1))

    def _objects(self, surface: pygame.Surface, inside: Rect, scene: Scene, ui: float) -> None:
        size, step = round(14 * ui), round(21 * ui)
        told = [thing for thing in scene.objects if thing.words]
        for thing in told:
            foot = (inside.left + round(4 * ui), inside.top + size)
            flag = look.thing(thing.name, ORIGIN, self._game.thing_style(thing.kind, thing.team))
            draw_sign(surface, flag.shapes, foot, 2 * size, ui)
            place = Rect(inside.left + round(24 * ui), inside.top, inside.width - round(24 * ui), size + 2)
            kit.write(surface, thing.words, place, size, palette.TEXT if thing.carrier else palette.MUTED, self._fonts)
            _cut(inside, step)
        _cut(inside, round(6 * ui) if told else 0)

    def _players(self, surface: pygame.Surface, inside: Rect, scene: Scene, ui: float, driving: str | None) -> None:
        if scene.players:
            _cut(inside, kit.heading(surface, inside, "PLAYERS", ui, self._fonts))
            room = Rect(inside.left, inside.top, inside.width, round(inside.height * _PLAYERS_SHARE))
            bottom = self._roster.draw(surface, room, scene, self._game, ui, driving) + round(10 * ui)
            _cut(inside, bottom - inside.top)

    def _calls(self, surface: pygame.Surface, inside: Rect, scene: Scene, ui: float) -> None:
        """Write the calls from `first` on, the newest on top, as many as there is room for."""
        self._shown, self._count = [], len(scene.calls)
        self.first = min(self.first, max(0, self._count - 1))
        if not scene.calls or inside.height < round(40 * ui):
            return
        words = "REFEREE: CLICK A CALL TO SEE WHY" if not self.first else f"REFEREE: {self.first} NEWER CALLS ABOVE"
        _cut(inside, kit.heading(surface, inside, words, ui, self._fonts))
        size, step, indent = round(13 * ui), round(17 * ui), round(54 * ui)
        for index, call in enumerate(reversed(scene.calls[: self._count - self.first])):
            if call.rule == "begin":
                # Each round has a line of its own.
                pygame.draw.line(surface, palette.LINE, inside.topleft, inside.topright)
                _cut(inside, round(4 * ui))
            lines = self._fonts.wrap(call.text, inside.width - indent, size)
            room = inside.height // step
            if room < len(lines):
                # Half a call misleads, but the newest is better shortened than absent.
                if index or room < 1:
                    return
                lines = self._fonts.wrap(call.text, inside.width - indent, size, lines=room)
            at = self._fonts.render(clock_text(call.clock), round(12 * ui), palette.MUTED, Face.MONO)
            surface.blit(at, (inside.left, inside.top + 1))
            colour = palette.TEXT if index == 0 or call.rule == "begin" else palette.MUTED
            top = inside.top
            for line in lines:
                surface.blit(self._fonts.render(line, size, colour), (inside.left + indent, inside.top))
                _cut(inside, step)
            self._shown.append((Rect(inside.left, top, inside.width, inside.top - top), call))
            _cut(inside, round(6 * ui))


def _cut(area: Rect, height: int) -> None:
    """Take so much from the top of an area."""
    area.top += height
    area.height -= height
