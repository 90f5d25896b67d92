"""Draws the panel beside the field: the state of the match, the players and the referee's words."""

from dataclasses import dataclass
from typing import Final

import pygame

from vrg.bus.messages import Call, Stage
from vrg.games import UNKNOWN, game_of
from vrg.games.game import title
from vrg.ui import kit, palette, shapes
from vrg.ui.roster import RosterPainter
from vrg.ui.scene import Scene, clock_text
from vrg.ui.text import Face, Fonts

_PLAYERS_SHARE: Final = 0.45
"""The part of the panel's height that the list of players may have."""


@dataclass
class _Pen:
    """Where the next line is written, pixels."""

    surface: pygame.Surface
    left: int
    right: int
    top: int
    bottom: int
    y: int

    @property
    def width(self) -> int:
        return self.right - self.left


class PanelPainter:
    """Draws the panel into a rectangle from the top down. What has no room is left out.

    Args:
        fonts: to write with.
    """

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._roster = RosterPainter(fonts)
        self._game = UNKNOWN
        self._shown: list[tuple[pygame.Rect, Call]] = []

    def draw(self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, ui: float, driving: str | None) -> None:
        """Draw the scene's words; `ui` scales letters, `driving` is the player that the user drives by hand."""
        pygame.draw.rect(surface, palette.PANEL, area)
        pygame.draw.line(surface, palette.LINE, area.topleft, area.bottomleft)
        before = surface.get_clip()
        surface.set_clip(area.clip(before))
        self._game = game_of(scene.game)
        pad = round(18 * ui)
        pen = _Pen(surface, area.left + pad, area.right - pad, area.top, area.bottom, area.top + pad)
        self._heading(pen, scene, ui)
        self._scores(pen, scene, ui)
        self._players(pen, scene, ui, driving)
        hint = self._fonts.render("? shows the keys", round(11 * ui), palette.MUTED)
        floor = area.bottom - round(10 * ui) - hint.get_height()
        surface.blit(hint, (pen.left, floor))
        self._calls(pen, scene, ui, floor - round(8 * ui))
        surface.set_clip(before)

    def call_at(self, place: tuple[int, int]) -> Call | None:
        """The call that is written at a pixel of the window; None if there is none."""
        return next((call for area, call in self._shown if area.collidepoint(place)), None)

    def _heading(self, pen: _Pen, scene: Scene, ui: float) -> None:
        size = round(21 * ui)
        name = self._fonts.shorten(
            self._game.title or title(scene.game) or "Waiting for the referee", pen.width, size, Face.BOLD
        )
        pen.surface.blit(self._fonts.render(name, size, palette.TEXT, Face.BOLD), (pen.left, pen.y))
        pen.y += round(size * 1.5)
        if scene.stage is None:
            return
        chips = [(title(scene.stage.value), palette.STAGE_COLOURS[scene.stage])]
        if scene.halted is not None and scene.stage is not Stage.GAME_OVER:
            chips.append(("Halt", palette.CAUTION))
        x = pen.left
        for words, colour in chips:
            x = kit.chip(pen.surface, (x, pen.y), words, colour, ui, self._fonts).right + round(6 * ui)
        counted = f"{self._game.round_word} {scene.round} of {scene.rounds}"
        text = self._fonts.render(counted, round(14 * ui), palette.TEXT)
        pen.surface.blit(text, (x + round(4 * ui), pen.y + round(3 * ui)))
        pen.y += round(32 * ui)
        big = self._fonts.render(clock_text(scene.clock), round(40 * ui), palette.TEXT, Face.MONO)
        pen.surface.blit(big, (pen.left, pen.y))
        notes = ["play clock", f"match {clock_text(scene.time)}"]
        if scene.rate != 1.0:
            notes.append(f"speed ×{scene.rate:g}" if scene.rate else "full speed")
        for index, note in enumerate(notes):
            small = self._fonts.render(note, round(11 * ui), palette.MUTED)
            pen.surface.blit(small, small.get_rect(topright=(pen.right, pen.y + round((5 + 15 * index) * ui))))
        pen.y += round(54 * ui)

    def _scores(self, pen: _Pen, scene: Scene, ui: float) -> None:
        if not scene.score:
            return
        gap, height = round(8 * ui), round(52 * ui)
        width = (pen.width - gap * (len(scene.score) - 1)) // len(scene.score)
        for index, (team, points) in enumerate(scene.score):
            card = pygame.Rect(pen.left + index * (width + gap), pen.y, width, height)
            shapes.pill(pen.surface, card, palette.RAISED)
            colour = self._game.team_style(team).colour
            pygame.draw.rect(
                pen.surface, colour, (card.left, card.top, round(4 * ui), height),
                border_top_left_radius=8, border_bottom_left_radius=8,
            )  # fmt: skip
            number = self._fonts.render(str(points), round(26 * ui), palette.TEXT, Face.BOLD)
            right = pen.surface.blit(number, number.get_rect(midright=(card.right - round(12 * ui), card.centery)))
            room = right.left - card.left - round(20 * ui)
            size = round(14 * ui)
            words = self._fonts.shorten(title(team), room, size)
            label = self._fonts.render(words, size, palette.MUTED)
            pen.surface.blit(label, label.get_rect(midleft=(card.left + round(14 * ui), card.centery)))
        pen.y += height + round(8 * ui)
        for thing in scene.objects:
            size = round(13 * ui)
            shapes.flag(
                pen.surface, (pen.left + round(4 * ui), pen.y + size), size, self._game.team_style(thing.team).colour
            )
            words = self._fonts.shorten(thing.words, pen.width - round(24 * ui), size)
            text = self._fonts.render(words, size, palette.TEXT if thing.carrier else palette.MUTED)
            pen.surface.blit(text, (pen.left + round(22 * ui), pen.y))
            pen.y += round(19 * ui)
        pen.y += round(8 * ui)

    def _section(self, pen: _Pen, words: str, ui: float) -> None:
        area = pygame.Rect(pen.left, pen.y, pen.width, 1)
        pen.y += kit.heading(pen.surface, area, words, ui, self._fonts)

    def _players(self, pen: _Pen, scene: Scene, ui: float, driving: str | None) -> None:
        if not scene.players:
            return
        self._section(pen, "PLAYERS", ui)
        room = pygame.Rect(pen.left, pen.y, pen.width, round((pen.bottom - pen.top) * _PLAYERS_SHARE))
        pen.y = self._roster.draw(pen.surface, room, scene, self._game, ui, driving) + round(10 * ui)

    def _calls(self, pen: _Pen, scene: Scene, ui: float, floor: int) -> None:
        """Write the last calls, the newest on top, as many as there is room for."""
        self._shown = []
        if not scene.calls or pen.y + round(50 * ui) > floor:
            return
        self._section(pen, "REFEREE: CLICK A CALL TO SEE WHY", ui)
        size, step = round(13 * ui), round(17 * ui)
        indent = round(54 * ui)
        for index, call in enumerate(reversed(scene.calls)):
            lines = self._fonts.wrap(call.text, pen.width - indent, size)
            room = (floor - pen.y) // step
            if room < len(lines):
                # A half-told call misleads, but the newest is better shortened than absent.
                if index or room < 1:
                    return
                lines = self._fonts.wrap(call.text, pen.width - indent, size, lines=room)
            at = self._fonts.render(clock_text(call.clock), round(12 * ui), palette.MUTED, Face.MONO)
            pen.surface.blit(at, (pen.left, pen.y + 1))
            colour = palette.TEXT if index == 0 else palette.MUTED
            top = pen.y
            for line in lines:
                pen.surface.blit(self._fonts.render(line, size, colour), (pen.left + indent, pen.y))
                pen.y += step
            self._shown.append((pygame.Rect(pen.left, top, pen.width, pen.y - top), call))
            pen.y += round(6 * ui)
