"""Draws the developers' view upon a surface of any size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import pygame

from vrg.bus.messages import Call
from vrg.colours import Rgb
from vrg.games import game_of
from vrg.hal.models import RobotModel
from vrg.ui import kit, palette
from vrg.ui.banner import Help
from vrg.ui.card import CardPainter
from vrg.ui.developer import details, referee, streams, tables, words
from vrg.ui.developer.choices import Layer, Tab, ViewState
from vrg.ui.developer.deciding import Button, disabled_reason, useful
from vrg.ui.developer.insight import Insight
from vrg.ui.developer.layout import Layout, layout
from vrg.ui.developer.lists import HitArea, ListPainter
from vrg.ui.developer.sensing import SensingPainter
from vrg.ui.explaining import Card
from vrg.ui.field import FieldPainter
from vrg.ui.header import HeaderPainter
from vrg.ui.scene import Scene
from vrg.ui.text import Fonts
from vrg.ui.view import Projection

_COLOURS: Final = {Button.STOP: palette.ALARM, Button.RESUME: palette.GOOD, Button.HALT: palette.CAUTION}
_HIT: Final = 24.0
"""Pixels from the middle of a robot within which a click on the field means it."""


@dataclass(frozen=True)
class Shown:
    """The places of everything in a frame.

    Args:
        layout: the places. view: how the field's coordinates became pixels. scene: what the field showed.
        players, page: the places in the list of players, and in the tab.
        lengths: how many rows each list has, and how many of them have room: the list of players is under None.
    """

    layout: Layout
    view: Projection
    scene: Scene
    players: tuple[HitArea, ...]
    page: tuple[HitArea, ...]
    lengths: Mapping[Tab | None, tuple[int, int]]

    def name_at(self, place: tuple[int, int]) -> str | None:
        """The player in whose row, or on whose robot, a pixel is; None if it is on none."""
        row = next((found.name for found in self.players if found.name and found.area.collidepoint(place)), None)
        if row is not None or not self.layout.field.collidepoint(place):
            return row
        near = []
        for body in self.scene.bodies:
            x, y = self.view.point(body.pose.x, body.pose.y)
            distance = ((x - place[0]) ** 2 + (y - place[1]) ** 2) ** 0.5
            if distance <= max(_HIT, self.view.scale * body.length / 2):
                near.append((distance, body.name))
        return min(near)[1] if near else None

    def call_at(self, place: tuple[int, int]) -> Call | None:
        """The call that is written at a pixel; None if there is none."""
        return next((found.call for found in self.page if found.call and found.area.collidepoint(place)), None)

    def heading_at(self, place: tuple[int, int]) -> str | None:
        """The heading of the tab's table at a pixel; None if there is none."""
        return next((found.heading for found in self.page if found.heading and found.area.collidepoint(place)), None)


class DeveloperPainter:
    """Draws what is known. The panel is drawn anew only when it is asked for, so that numbers can be read.

    Args:
        robots: the models of the players' robots, by name.
    """

    def __init__(self, robots: Mapping[str, RobotModel]) -> None:
        self._fonts = Fonts()
        self._field = FieldPainter(self._fonts)
        self._sensing = SensingPainter(robots)
        self._header = HeaderPainter(self._fonts, Help.KEYS)
        self._card = CardPainter(self._fonts)
        self._lists = ListPainter(self._fonts)
        self._panel: tuple[Layout, pygame.Surface, Shown] | None = None

    def draw(
        self,
        surface: pygame.Surface,
        insight: Insight,
        choices: ViewState,
        *,
        driving: str | None = None,
        notice: str = "",
        card: Card | None = None,
        keys: Sequence[tuple[str, str]] = (),
        panel: bool = True,
    ) -> Shown:
        """Draw everything.

        Args:
            driving: the player that the user drives by hand. notice: what the user must read.
            card: why a call was made. keys: those to list, with their meanings.
            panel: draw the panel anew; else it is copied.
        """
        places = layout(*surface.get_size(), len(insight.scene.players))
        surface.fill(palette.BACKGROUND)
        view = self._draw_field(surface, places, insight, choices, driving)
        self._switches(surface, places, choices)
        self._buttons(surface, places, insight, choices)
        tone = tables.Tone.ALARM if driving is None or insight.refusal else tables.Tone.CAUTION
        size = max(11, round(13 * places.ui))
        notice = insight.refusal or notice
        if not notice:
            notice, tone = words.OFFICIAL_SEAT if insight.official else words.WINDOW_SEAT, tables.Tone.QUIET
        self._lists.line(surface, places.notice, notice, size, tone)
        shown = self._draw_panel(surface, places, insight, choices, view, panel=panel)
        if card is not None and not keys:
            self._card.draw(surface, places.field, card, places.ui, turned=view.turned)
        self._header.draw(surface, places.head, insight.scene, places.ui)
        if keys:
            kit.keys(surface, places.field, keys, places.ui, self._fonts)
        return replace(shown, view=view, scene=insight.scene)

    def _draw_field(
        self, surface: pygame.Surface, places: Layout, insight: Insight, choices: ViewState, driving: str | None
    ) -> Projection:
        ui, area, scene = places.ui, places.field, insight.scene
        wanted = scene
        if Layer.SKETCHES not in choices.shown:
            wanted = replace(wanted, strokes=())
        if Layer.TRAILS not in choices.shown:
            wanted = replace(wanted, bodies=tuple(replace(body, trail=()) for body in wanted.bodies))
        return self._field.draw(
            surface,
            area,
            wanted,
            ui,
            driving or choices.selected,
            below=lambda view: self._sensing.draw(surface, view, insight, choices.shown, choices.selected, ui),
            names=Layer.NAMES in choices.shown,
        )

    def _switches(self, surface: pygame.Surface, places: Layout, choices: ViewState) -> None:
        for overlay, place in places.overlays.items():
            on = overlay in choices.shown
            self._button(surface, place, *words.OVERLAYS[overlay], palette.CALM if on else palette.PANEL, places.ui, on)

    def _buttons(self, surface: pygame.Surface, places: Layout, insight: Insight, choices: ViewState) -> None:
        for button, place in places.buttons.items():
            name, key = button.value
            allowed = not disabled_reason(button, insight, choices.selected)
            lit = button is Button.STOP or useful(button, insight, choices.selected)
            colour = _COLOURS.get(button, palette.CALM) if lit else palette.RAISED if allowed else palette.PANEL
            self._button(surface, place, name, key, colour, places.ui, allowed)

    def _button(
        self, surface: pygame.Surface, place: pygame.Rect, name: str, key: str, colour: Rgb, ui: float, allowed: bool
    ) -> None:
        kit.button(surface, place, name, key, colour, ui, self._fonts, size=12.5, allowed=allowed)

    def _draw_panel(
        self,
        surface: pygame.Surface,
        places: Layout,
        insight: Insight,
        choices: ViewState,
        view: Projection,
        *,
        panel: bool,
    ) -> Shown:
        if not panel and self._panel is not None and self._panel[0] == places:
            surface.blit(self._panel[1], places.panel)
            return self._panel[2]
        pygame.draw.rect(surface, palette.PANEL, places.panel)
        edge = places.panel
        if edge.top:
            pygame.draw.line(surface, palette.LINE, edge.topleft, edge.topright)
        else:
            pygame.draw.line(surface, palette.LINE, edge.topleft, edge.bottomleft)
        before = surface.get_clip()
        surface.set_clip(edge.clip(before))
        scene = insight.scene
        game = game_of(scene.game)
        listed = tables.players(insight)
        lengths: dict[Tab | None, tuple[int, int]] = {
            None: (len(listed.lines), self._lists.rows(places.players, places.row))
        }
        players = self._lists.grid(
            surface, places.players, listed, places.row, places.ui,
            first=choices.scrolled.get(None, 0), marked=choices.selected,
            styles={player.name: game.style(player.role, player.state) for player in scene.players},
        )  # fmt: skip
        for tab, place in places.tabs.items():
            chosen = tab is choices.tab
            colour = palette.CALM if chosen else palette.PANEL
            self._button(surface, place, *words.TABS[tab], colour, places.ui, chosen)
        page = self._page(surface, places, insight, choices, lengths)
        surface.set_clip(before)
        shown = Shown(places, view, scene, tuple(players), tuple(page), lengths)
        self._panel = places, surface.subsurface(edge.clip(surface.get_rect())).copy(), shown
        return shown

    def _page(
        self,
        surface: pygame.Surface,
        places: Layout,
        insight: Insight,
        choices: ViewState,
        lengths: dict[Tab | None, tuple[int, int]],
    ) -> list[HitArea]:
        area, ui, tab = places.page, places.ui, choices.tab
        first = choices.scrolled.get(tab, 0)
        if tab in (Tab.REFEREE, Tab.PLAYER):
            items = referee.referee(insight) if tab is Tab.REFEREE else details.details(insight, choices.selected)
            # The last item may be long: it can be scrolled to the top.
            lengths[tab] = len(items), 1
            return self._lists.items(surface, area, items, ui, first=min(first, len(items) - 1))
        row, line = round(17 * ui), round(17 * ui)
        top = pygame.Rect(area.left, area.top, area.width, line)
        if tab is Tab.STREAMS:
            self._lists.line(surface, top, streams.totals(insight.streams), max(10, round(11.5 * ui)))
            if insight.unheard:
                top = top.move(0, line)
                unheard = words.NOT_HEARD.format(", ".join(insight.unheard))
                self._lists.line(surface, top, unheard, max(10, round(11.5 * ui)), tables.Tone.CAUTION)
            grid, empty = streams.streams(insight.streams, choices.sort), words.NOTHING_HEARD
        else:
            grid, empty = tables.processes(insight), words.NO_PROCESSES
            top.height = 0
        below = pygame.Rect(area.left, top.bottom, area.width, max(1, area.bottom - top.bottom))
        if not grid.lines:
            self._lists.line(surface, pygame.Rect(below.topleft, (below.width, line)), empty, round(12.5 * ui))
            return []
        lengths[tab] = len(grid.lines), self._lists.rows(below, row)
        sort = choices.sort if tab is Tab.STREAMS else None
        return self._lists.grid(surface, below, grid, row, ui, first=first, sort=sort)
