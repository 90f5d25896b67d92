"""Draws the panel beside the field: the state of the match, the players, the referee's words and the keys."""

from dataclasses import dataclass
from typing import Final

import pygame

from vrg.bus.messages import Stage
from vrg.colours import Rgb
from vrg.games import UNKNOWN, game_of
from vrg.games.game import title
from vrg.ui import palette, shapes
from vrg.ui.palette import ink_on
from vrg.ui.scene import Scene, ScenePlayer, clock_text
from vrg.ui.text import Face, Fonts

KEYS: Final = (
    ("SPACE", "emergency stop"),
    ("U", "release the stop"),
    ("H", "halt"),
    ("C", "continue"),
    ("R", "recover robots"),
    ("TAB", "drive a player"),
    ("ARROWS", "steer"),
    ("ESC", "give it back"),
    ("P", "picture"),
    ("Q", "close window"),
)

PHYSICAL_RIM: Final = 2
"""Pixels of white around the badge of a player with a physical robot, as around its body."""


@dataclass
class _Pen:
    """Where the next line is written, pixels."""

    surface: pygame.Surface
    left: int
    right: int
    y: int

    @property
    def width(self) -> int:
        return self.right - self.left


class PanelPainter:
    """Draws the panel into a rectangle from the top down. What has no room is left out, the keys first."""

    def __init__(self, fonts: Fonts) -> None:
        self._fonts = fonts
        self._game = UNKNOWN

    def draw(self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, ui: float, driving: str | None) -> None:
        """Draw the scene's words; `ui` scales letters, `driving` is the player that the user drives by hand."""
        pygame.draw.rect(surface, palette.PANEL, area)
        pygame.draw.line(surface, palette.LINE, area.topleft, area.bottomleft)
        before = surface.get_clip()
        surface.set_clip(area.clip(before))
        self._game = game_of(scene.game)
        pad = round(18 * ui)
        pen = _Pen(surface, area.left + pad, area.right - pad, area.top + pad)
        self._heading(pen, scene, ui)
        self._scores(pen, scene, ui)
        self._players(pen, scene, ui, driving)
        floor = area.bottom - round(10 * ui)
        keys = self._keys_height(ui)
        if pen.y + keys + round(70 * ui) < floor:
            floor -= keys
            self._keys(pen, floor, ui)
        self._calls(pen, scene, ui, floor - round(8 * ui))
        surface.set_clip(before)

    def _heading(self, pen: _Pen, scene: Scene, ui: float) -> None:
        size = round(21 * ui)
        name = self._fonts.shorten(title(scene.game) or "Waiting for the referee", pen.width, size, Face.BOLD)
        pen.surface.blit(self._fonts.render(name, size, palette.TEXT, Face.BOLD), (pen.left, pen.y))
        pen.y += round(size * 1.5)
        if scene.stage is None:
            return
        x = self._chip(pen, pen.left, title(scene.stage.value), palette.STAGE_COLOURS[scene.stage], ui)
        if scene.halted is not None and scene.stage is not Stage.GAME_OVER:
            x = self._chip(pen, x + round(6 * ui), "Halt", palette.CAUTION, ui)
        counted = f"{self._game.round_word} {scene.round} of {scene.rounds}"
        text = self._fonts.render(counted, round(14 * ui), palette.TEXT)
        pen.surface.blit(text, (x + round(10 * ui), pen.y + round(3 * ui)))
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

    def _chip(self, pen: _Pen, left: int, words: str, colour: Rgb, ui: float) -> int:
        text = self._fonts.render(words, round(13 * ui), ink_on(colour), Face.BOLD)
        chip = pygame.Rect(left, pen.y, text.get_width() + round(18 * ui), round(24 * ui))
        shapes.pill(pen.surface, chip, colour, radius=chip.height // 2)
        pen.surface.blit(text, text.get_rect(center=chip.center))
        return chip.right

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
        pen.y += height + round(16 * ui)

    def _section(self, pen: _Pen, words: str, ui: float) -> None:
        text = self._fonts.render(words, round(11 * ui), palette.MUTED, Face.BOLD)
        pen.surface.blit(text, (pen.left, pen.y))
        y = pen.y + text.get_height() // 2
        start = pen.left + text.get_width() + round(8 * ui)
        pygame.draw.line(pen.surface, palette.LINE, (start, y), (pen.right, y))
        pen.y += round(20 * ui)

    def _players(self, pen: _Pen, scene: Scene, ui: float, driving: str | None) -> None:
        if not scene.players:
            return
        self._section(pen, "PLAYERS", ui)
        physical = {body.name for body in scene.bodies if body.physical}
        for player in scene.players:
            self._player(pen, player, ui, driven=player.name == driving, physical=player.name in physical)
        pen.y += round(10 * ui)

    def _player(self, pen: _Pen, player: ScenePlayer, ui: float, *, driven: bool, physical: bool) -> None:
        row = round(24 * ui)
        if driven:
            back = pygame.Rect(pen.left - round(8 * ui), pen.y, pen.width + round(16 * ui), row)
            shapes.pill(pen.surface, back, palette.mix(palette.PANEL, palette.CAUTION, 0.22), radius=6)
        style = self._game.style(player.role, player.state)
        middle = pen.y + row // 2
        badge = pygame.Rect(0, 0, round(18 * ui), round(18 * ui))
        badge.center = (pen.left + badge.width // 2, middle)
        if physical:
            shapes.pill(pen.surface, badge.inflate(2 * PHYSICAL_RIM, 2 * PHYSICAL_RIM), palette.TEXT, radius=6)
        shapes.pill(pen.surface, badge, style.colour, radius=4)
        shapes.marker(pen.surface, badge.center, 1.5708, badge.width * 0.32, palette.INK, style.marker)
        columns = (0.10, 0.42, 0.62)
        quiet = player.out_of_play
        does = player.state if quiet else player.mode.rpartition("/")[2] or player.state
        state = "by hand" if driven or player.manual else does
        cells = (
            (player.name, Face.BOLD, palette.MUTED if quiet else palette.TEXT),
            (player.role, Face.REGULAR, style.colour if not quiet else palette.MUTED),
            (state, Face.REGULAR, palette.CAUTION if state == "by hand" else palette.MUTED),
        )
        size = round(13 * ui)
        for (words, face, colour), begin, end in zip(cells, columns, (*columns[1:], 1.0), strict=True):
            room = round(pen.width * (end - begin)) - round(6 * ui)
            text = self._fonts.render(self._fonts.shorten(words, room, size, face), size, colour, face)
            pen.surface.blit(text, text.get_rect(midleft=(pen.left + round(pen.width * begin), middle)))
        pen.y += row
        if player.fault:
            size = round(11 * ui)
            indent = round(pen.width * columns[0])
            for line in self._fonts.wrap(player.fault, pen.width - indent, size, lines=3):
                warning = self._fonts.render(line, size, palette.CAUTION)
                pen.surface.blit(warning, (pen.left + indent, pen.y))
                pen.y += round(15 * ui)

    def _calls(self, pen: _Pen, scene: Scene, ui: float, floor: int) -> None:
        """Write the last calls, the newest on top, as many as there is room for."""
        if not scene.calls or pen.y + round(50 * ui) > floor:
            return
        self._section(pen, "REFEREE", ui)
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
            for line in lines:
                pen.surface.blit(self._fonts.render(line, size, colour), (pen.left + indent, pen.y))
                pen.y += step
            pen.y += round(6 * ui)

    def _keys_height(self, ui: float) -> int:
        return round((20 + 22 * ((len(KEYS) + 1) // 2)) * ui)

    def _keys(self, pen: _Pen, top: int, ui: float) -> None:
        heading = _Pen(pen.surface, pen.left, pen.right, top)
        self._section(heading, "KEYS", ui)
        rows = (len(KEYS) + 1) // 2
        size = round(11 * ui)
        for index, (key, meaning) in enumerate(KEYS):
            column, row = divmod(index, rows)
            left = pen.left + column * (pen.width // 2 + round(6 * ui))
            y = heading.y + round(22 * ui) * row
            cap = self._fonts.render(key, round(10 * ui), palette.TEXT, Face.BOLD)
            box = pygame.Rect(left, y, max(cap.get_width() + round(10 * ui), round(20 * ui)), round(18 * ui))
            shapes.pill(pen.surface, box, palette.RAISED, radius=4)
            pygame.draw.rect(pen.surface, palette.LINE, box, 1, border_radius=4)
            pen.surface.blit(cap, cap.get_rect(center=box.center))
            room = pen.width // 2 - box.width - round(8 * ui)
            text = self._fonts.render(self._fonts.shorten(meaning, room, size), size, palette.MUTED)
            pen.surface.blit(text, text.get_rect(midleft=(box.right + round(6 * ui), box.centery)))
