"""Draws the welcome screen."""

import pygame

from vrg.colours import Rgb
from vrg.games import game_of
from vrg.ui import palette, shapes
from vrg.ui.kit import blank, button, frame, row, write
from vrg.ui.text import Face, Fonts
from vrg.ui.welcome import words
from vrg.ui.welcome.field_painter import DraftPainter
from vrg.ui.welcome.layout import LobbyLayout, lobby_layout
from vrg.ui.welcome.lobby import BUTTONS, List, Lobby, Recent, Wish

_TITLES = {List.GAMES: words.GAMES, List.MAPS: words.MAPS, List.RECENT: words.RECENT}


class LobbyPainter:
    """Draws the welcome screen."""

    def __init__(self, fonts: Fonts, field: DraftPainter) -> None:
        self._fonts = fonts
        self._field = field

    def draw(self, surface: pygame.Surface, lobby: Lobby) -> LobbyLayout:
        """Draw everything, and return where it is."""
        counts = {which: lobby.rows(which) for which in List}
        places = lobby_layout(surface.get_size(), counts, lobby.at)
        ui, fonts = places.ui, self._fonts
        surface.fill(palette.BACKGROUND)
        pygame.draw.rect(surface, palette.PANEL, places.head)
        pad = round(14 * ui)
        inside = places.head.inflate(-2 * pad, 0)
        inside.width = max(1, places.help.left - pad - inside.left)
        write(surface, words.TITLE, inside, round(22 * ui), palette.TEXT, fonts, Face.BOLD)
        used = fonts.width(words.TITLE, round(22 * ui), Face.BOLD) + 2 * pad
        hint = pygame.Rect(inside.left + used, inside.top, max(1, inside.width - used), inside.height)
        write(surface, words.LOBBY_HINT, hint, round(14 * ui), palette.MUTED, fonts)
        button(surface, places.help, words.HELP[0], "?", palette.RAISED, ui, fonts)
        for which, plate in places.plates.items():
            inner = frame(surface, plate, _TITLES[which], "", ui, fonts)
            if not counts[which]:
                blank(surface, inner, words.NO_RECENT, ui, fonts)
            for index, rect in enumerate(places.rows[which]):
                self._row(surface, lobby, which, index + places.first[which], rect, ui)
        self._preview(surface, lobby, places)
        return places

    def _row(
        self, surface: pygame.Surface, lobby: Lobby, which: List, number: int, rect: pygame.Rect, ui: float
    ) -> None:
        # Either a game with a map is chosen, or a recent match.
        chosen = lobby.at[which] == number and (which is List.RECENT) == (lobby.active is List.RECENT)
        plate = rect.inflate(0, -max(2, round(3 * ui)))
        if chosen:
            shapes.pill(surface, plate, palette.CALM, radius=round(6 * ui))
            if lobby.active is which:
                pygame.draw.rect(surface, palette.CAUTION, plate, max(1, round(2 * ui)), border_radius=round(6 * ui))
        inside = plate.inflate(-round(16 * ui), -2)
        match which:
            case List.GAMES:
                self._game(surface, lobby.games[number], inside, ui, palette.TEXT if chosen else palette.MUTED)
            case List.MAPS:
                name = lobby.maps[number]
                ink = palette.TEXT if name or chosen else palette.MUTED
                write(surface, name or words.OWN_MAP, inside, round(15 * ui), ink, self._fonts)
            case List.RECENT:
                self._recent(surface, lobby.recent[number], inside, ui)

    def _game(self, surface: pygame.Surface, name: str, inside: pygame.Rect, ui: float, ink: Rgb) -> None:
        """Write a game with its roles and what happens in it."""
        fonts, game = self._fonts, game_of(name)
        size, small = round(17 * ui), max(12, round(13 * ui))
        lines = fonts.wrap(game.about, inside.width, small, lines=2)
        step = round(17 * ui)
        lines = lines[: max(0, (inside.height - round(24 * ui)) // step)]
        top = inside.centery - (round(24 * ui) + step * len(lines)) // 2
        head = pygame.Rect(inside.left, top, inside.width, round(24 * ui))
        right = head.right
        for role in reversed(game.roles):
            word = fonts.render(role.name, small, palette.TEXT)
            spot = word.get_rect(midright=(right, head.centery))
            surface.blit(word, spot)
            shapes.marker(surface, (spot.left - 9 * ui, head.centery), 0.0, 6 * ui, role.colour, role.marker)
            right = spot.left - round(24 * ui)
        head.width = max(1, right - head.left)
        write(surface, game.title, head, size, palette.TEXT, fonts, Face.BOLD)
        for index, line in enumerate(lines):
            place = pygame.Rect(inside.left, head.bottom + index * step, inside.width, step)
            write(surface, line, place, small, ink, fonts)

    def _recent(self, surface: pygame.Surface, recent: Recent, inside: pygame.Rect, ui: float) -> None:
        size = max(12, round(14 * ui))
        gap = round(10 * ui)
        name, game, when, told = row(inside, (0.95, 1.15, 0.85, 2.6), gap)
        write(surface, recent.name, name, size, palette.TEXT, self._fonts, Face.BOLD)
        write(surface, game_of(recent.game).title if recent.game else "", game, size, palette.TEXT, self._fonts)
        write(surface, recent.when, when, size, palette.MUTED, self._fonts)
        write(surface, recent.told or words.MATCH_FILE, told, size, palette.TEXT, self._fonts)

    def _preview(self, surface: pygame.Surface, lobby: Lobby, places: LobbyLayout) -> None:
        ui, draft = places.ui, lobby.draft
        says = ""
        if draft is not None and draft.data:
            count = len(draft.players)
            says = f"{draft.shown('name')}: {count} {'player' if count == 1 else 'players'}, map {draft.shown('map')}"
        verdict = lobby.verdict if lobby.checked else None
        shapes.pill(surface, places.shown, palette.PANEL, radius=round(8 * ui))
        self._field.draw(surface, places.field, draft, lobby.verdict, ui, says=says)
        problem = verdict.problems[0].text if verdict is not None and verdict.problems else ""
        told = lobby.notice or (words.WRONG_CHOICE.format(problem=problem) if problem else "")
        size, top = max(12, round(14 * ui)), places.notice.top
        for line in self._fonts.wrap(told, places.notice.width, size, lines=2):
            surface.blit(self._fonts.render(line, size, palette.WARNING), (places.notice.left, top))
            top += round(20 * ui)
        recorded = lobby.chosen is not None and lobby.chosen.recorded
        for wish, rect in places.buttons.items():
            colour = palette.GOOD if wish is Wish.START and not problem else palette.RAISED
            if wish is Wish.WATCH and not recorded:
                continue
            button(surface, rect, *BUTTONS[wish], colour, ui, self._fonts)
