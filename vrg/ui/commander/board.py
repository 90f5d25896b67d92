"""Draws the commander's panel beside the field: the priority in large letters, the buttons, the players, the lights."""

from dataclasses import dataclass
from typing import Final

import pygame

from vrg.colours import GREEN, SKY_BLUE, VERMILLION, YELLOW, Rgb, mix
from vrg.games import game_of
from vrg.games.game import title
from vrg.ui import palette
from vrg.ui.commander.deck import BUTTONS, Deck
from vrg.ui.palette import ink_on
from vrg.ui.scene import Scene, ScenePlayer
from vrg.ui.window import shapes
from vrg.ui.window.text import Face, Fonts

FACES: Final[tuple[tuple[str, Rgb, tuple[int, int]], ...]] = (
    ("A", GREEN, (0, 1)),
    ("B", VERMILLION, (1, 0)),
    ("X", SKY_BLUE, (-1, 0)),
    ("Y", YELLOW, (0, -1)),
)
"""The face buttons: the letter, the colour, and the place in the diamond, to the right and down."""
ARROWS: Final = ("▲", "▶", "▼", "◀")
"""The directional buttons, in the order of the players."""
OWN: Final = "OWN STRATEGIES"


@dataclass(frozen=True)
class Lights:
    """The state of what a commander needs, in words. Empty words mean that all is well.

    Args:
        bus: what is wrong with the connection. robot: what keeps the driven robot from moving.
        pad: the gamepad in use. pad_ready: there is one.
    """

    bus: str = ""
    robot: str = ""
    pad: str = ""
    pad_ready: bool = False


class BoardPainter:
    """Draws the panel from the top down.

    Args:
        fonts: to write with. deck: what the commander has chosen.

    Attributes:
        lights: whether all is well. limited: the team does not see everybody.
    """

    def __init__(self, fonts: Fonts, deck: Deck) -> None:
        self._fonts = fonts
        self._deck = deck
        self.lights = Lights()
        self.limited = False

    def draw(self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, ui: float, driving: str | None) -> None:
        """Draw the whole panel into an area; `ui` scales letters."""
        pygame.draw.rect(surface, palette.PANEL, area)
        pygame.draw.line(surface, palette.LINE, area.topleft, area.bottomleft)
        before = surface.get_clip()
        surface.set_clip(area.clip(before))
        pad = round(16 * ui)
        inside = area.inflate(-2 * pad, -2 * pad)
        y = self._heading(surface, inside, scene, ui)
        if self._deck.priorities:
            y = self._priority(surface, inside, y, scene, ui)
            y = self._diamond(surface, inside, y, ui)
        y = self._players(surface, inside, y, scene, ui)
        self._lights(surface, inside, y, ui)
        surface.set_clip(before)

    def _write(
        self, surface: pygame.Surface, words: str, at: tuple[int, int], size: int, colour: Rgb, *, room: int, bold: bool
    ) -> pygame.Rect:
        face = Face.BOLD if bold else Face.REGULAR
        text = self._fonts.render(self._fonts.shorten(words, room, size, face), size, colour, face)
        return surface.blit(text, at)

    def _heading(self, surface: pygame.Surface, area: pygame.Rect, scene: Scene, ui: float) -> int:
        game = game_of(scene.game)
        colour = game.team_style(self._deck.team).colour
        bar = pygame.Rect(area.left, area.top, area.width, round(34 * ui))
        shapes.pill(surface, bar, colour)
        name = self._fonts.render(f"{title(self._deck.team)} team", round(19 * ui), ink_on(colour), Face.BOLD)
        surface.blit(name, name.get_rect(midleft=(bar.left + round(12 * ui), bar.centery)))
        if self.limited:
            text = self._fonts.render("limited view", round(14 * ui), ink_on(colour))
            surface.blit(text, text.get_rect(midright=(bar.right - round(12 * ui), bar.centery)))
        return bar.bottom + round(10 * ui)

    def _priority(self, surface: pygame.Surface, area: pygame.Rect, y: int, scene: Scene, ui: float) -> int:
        """The priority in large letters, with what it means; or whom the commander drives."""
        chosen = next((p for p in self._deck.priorities if p.name == self._deck.priority), None)
        letter = self._deck.priorities.index(chosen) if chosen is not None else None
        colour = palette.RAISED if letter is None else FACES[letter][1]
        plate = pygame.Rect(area.left, y, area.width, round(84 * ui))
        shapes.pill(surface, plate, colour, radius=10)
        words = OWN if chosen is None else chosen.title.upper()
        size = round((34 if chosen is not None else 24) * ui)
        while size > round(16 * ui) and self._fonts.width(words, size, Face.BOLD) > plate.width - round(24 * ui):
            size -= 1
        text = self._fonts.render(words, size, ink_on(colour), Face.BOLD)
        surface.blit(text, text.get_rect(center=(plate.centerx, plate.top + round(32 * ui))))
        meaning = "every player follows its own strategy" if chosen is None else chosen.meaning
        if self._deck.selected is not None:
            meaning = "give the player back to change this"
        small = round(12 * ui)
        line = self._fonts.render(
            self._fonts.shorten(meaning, plate.width - round(20 * ui), small), small, ink_on(colour)
        )
        surface.blit(line, line.get_rect(center=(plate.centerx, plate.bottom - round(18 * ui))))
        return plate.bottom + round(10 * ui)

    def _diamond(self, surface: pygame.Surface, area: pygame.Rect, y: int, ui: float) -> int:
        """The four face buttons as they are on the pad, with what each sets."""
        radius, step = round(17 * ui), round(40 * ui)
        centre = (area.centerx, y + step + radius)
        asleep = self._deck.selected is not None
        for index, (letter, colour, (right, down)) in enumerate(FACES):
            x, button_y = centre[0] + right * step, centre[1] + down * step
            known = self._deck.priorities[index] if index < len(self._deck.priorities) else None
            active = known is not None and known.name == self._deck.priority
            faint = (asleep and not active) or known is None
            shown = mix(colour, palette.PANEL, 0.7) if faint else colour
            shapes.disc(surface, (x, button_y), radius, shown)
            if active:
                shapes.ring(surface, (x, button_y), radius + 4 * ui, palette.TEXT, 2.5 * ui)
            sign = self._fonts.render(letter, round(16 * ui), ink_on(shown), Face.BOLD)
            surface.blit(sign, sign.get_rect(center=(x, button_y)))
            if known is None:
                continue
            size = round(13 * ui)
            text = self._fonts.render(known.title, size, palette.MUTED if asleep else palette.TEXT)
            gap = radius + round(8 * ui)
            place = text.get_rect(midleft=(x + gap, button_y))
            if right < 0:
                place = text.get_rect(midright=(x - gap, button_y))
            surface.blit(text, place)
        return centre[1] + step + radius + round(14 * ui)

    def _players(self, surface: pygame.Surface, area: pygame.Rect, y: int, scene: Scene, ui: float) -> int:
        deck, row = self._deck, round(34 * ui)
        pages = -(-len(deck.players) // BUTTONS)
        words = "PLAYERS" if pages < 2 else f"PLAYERS, page {deck.page + 1} of {pages} (TAB, or press the right stick)"
        self._write(surface, words, (area.left, y), round(11 * ui), palette.MUTED, room=area.width, bold=True)
        y += round(18 * ui)
        for index, name in enumerate(deck.shown):
            player = scene.player(name)
            box = pygame.Rect(area.left, y, area.width, row - round(4 * ui))
            chosen = name == deck.selected
            shapes.pill(surface, box, palette.CAUTION if chosen else palette.RAISED, radius=6)
            ink = palette.INK if chosen else palette.TEXT
            arrow = self._fonts.render(f"{index + 1} {ARROWS[index]}", round(13 * ui), ink, Face.BOLD)
            surface.blit(arrow, arrow.get_rect(center=(box.left + round(20 * ui), box.centery)))
            size = round(14 * ui)
            text = self._fonts.render(self._fonts.shorten(name, round(110 * ui), size, Face.BOLD), size, ink, Face.BOLD)
            surface.blit(text, text.get_rect(midleft=(box.left + round(40 * ui), box.centery)))
            does = _does(player, chosen)
            room = box.width - round(170 * ui)
            text = self._fonts.render(self._fonts.shorten(does, room, size), size, ink)
            surface.blit(text, text.get_rect(midright=(box.right - round(10 * ui), box.centery)))
            y += row
        return y + round(6 * ui)

    def _lights(self, surface: pygame.Surface, area: pygame.Rect, y: int, ui: float) -> None:
        lights, size, row = self.lights, round(12 * ui), round(20 * ui)
        rows = (
            ("BUS", lights.bus or "connected", palette.ALARM if lights.bus else palette.GOOD),
            ("ROBOT", lights.robot or "ready", palette.ALARM if lights.robot else palette.GOOD),
            ("PAD", lights.pad, palette.GOOD if lights.pad_ready else palette.MUTED),
        )
        for word, reason, colour in rows:
            shapes.disc(surface, (area.left + 6 * ui, y + size * 0.6), 5 * ui, colour)
            self._write(surface, word, (area.left + round(18 * ui), y), size, palette.TEXT, room=60, bold=True)
            at = (area.left + round(70 * ui), y)
            self._write(surface, reason, at, size, palette.MUTED, room=area.width - round(70 * ui), bold=False)
            y += row
        line = "? keys, START drives, BACK: emergency stop"
        self._write(
            surface, line, (area.left, y + round(6 * ui)), round(11 * ui), palette.MUTED, room=area.width, bold=False
        )


def _does(player: ScenePlayer | None, chosen: bool) -> str:
    """A player's activity, in a few words."""
    if player is None:
        return "not there"
    if player.fault:
        return player.fault
    if player.leased:
        return f"{player.state}: led by the referee"
    deed = "you drive" if chosen and player.by_hand else player.mode.rpartition("/")[2]
    return f"{player.state}: {deed}" if deed else player.state
