"""The developers' view as a node: it shows the whole match, and publishes what an official at it decides."""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call
from vrg.bus.node import Node, Tick
from vrg.bus.topics import Keys
from vrg.bus.traffic import Traffic
from vrg.hal.models import RobotModel
from vrg.regions import Region
from vrg.ui.builder import SceneBuilder
from vrg.ui.controls import Controls
from vrg.ui.developer import deciding
from vrg.ui.developer.choices import Choices, Tab
from vrg.ui.developer.insight import Hearing, Insight
from vrg.ui.developer.painter import DeveloperPainter, Shown
from vrg.ui.developer.sensing import DRAWN
from vrg.ui.draw import save_numbered
from vrg.ui.explaining import Explainer
from vrg.ui.pace import Pace
from vrg.ui.spectator import FRAME
from vrg.ui.window import open_window, toggle_whole_screen

log = logging.getLogger(__name__)

PANEL_EVERY: Final = 6
"""The panel is drawn anew at every so many frames, and when something was pressed."""


class DeveloperWindow(Node):
    """Shows everything of a match in a window. It opens at the first tick; closing it does not end the match.

    Args:
        name: the name of the node. mailbox: the node's own. keys: of the match.
        traffic: counts what is heard. Whoever runs the node attaches it to the bus.
        robots: the models of the players' robots, by name. obstacles: the ground that walls and obstacles cover, m.
        size: of the window, pixels.
        run: the run folder, for pictures and to explain calls; None if it is not on this machine.
        official: whether this window has an official's seat.

    Raises:
        LaunchError: at the first tick, there is no display.
    """

    kind: ClassVar[str] = "spectator"

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        traffic: Traffic,
        *,
        robots: Mapping[str, RobotModel] | None = None,
        obstacles: Sequence[Region] = (),
        size: tuple[int, int] = (1280, 720),
        run: Path | None = None,
        period: float = FRAME,
        official: bool = True,
    ) -> None:
        super().__init__(name, mailbox, period)
        self.traffic = traffic
        self.choices = Choices()
        self._title = f"VRG: {keys.match}, developers' view"
        self._size = size
        self._run = run
        self._robots = dict(robots or {})
        builder = SceneBuilder(sizes={name: model.size for name, model in self._robots.items()}, obstacles=obstacles)
        self._hearing = Hearing(mailbox, keys, traffic, builder, self._robots, official=official)
        self._controls = Controls(mailbox, keys, by=name, official=official)
        self._explainer = Explainer(run)
        self._insight = Insight(official=official)
        self._painter: DeveloperPainter | None = None
        self._shown: Shown | None = None
        self._notice = ""
        self._frames = 0
        self._pace = Pace(FRAME)
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether the user has closed the window: the node need not be ticked any more."""
        return self._closed

    @property
    def insight(self) -> Insight:
        """What the window showed last."""
        return self._insight

    @property
    def shown(self) -> Shown | None:
        """Where everything was in the window last; None before the first frame."""
        return self._shown

    def tick(self, tick: Tick) -> None:
        """Take in messages and events, publish what the user decides, and draw at most one frame."""
        if self._closed:
            return
        if self._painter is None:
            open_window(self._title, self._size)
            self._painter = DeveloperPainter(self._robots)
        self._hearing.take(tick.time)
        asked = self._handle_events() | self._explainer.look()
        if self._controls.quit:
            self._close()
            return
        if self._controls.driving is not None and self._controls.driving not in self._players:
            self._controls.give_back()
        if tick.live:
            self._controls.steer()
        if self._pace.due(tick, self._insight.scene.rate) or asked:
            self._draw(tick, asked=asked)

    def stop(self) -> None:
        """Give the driven player back and close the window. Calling it again does nothing."""
        self._controls.give_back()
        self._explainer.close()
        self._close()

    @property
    def _players(self) -> list[str]:
        return [player.name for player in self._insight.scene.players]

    def _close(self) -> None:
        self._closed = True
        if self._painter is not None:
            self._painter = None
            pygame.display.quit()

    def _handle_events(self) -> bool:
        """Handle the events, and return whether anything happened that should be seen at once."""
        seen = False
        for event in pygame.event.get():
            match event.type:
                case pygame.KEYDOWN:
                    self._key(event)
                case pygame.KEYUP:
                    self._controls.release(event.key)
                case pygame.MOUSEBUTTONDOWN if event.button == pygame.BUTTON_LEFT:
                    self._click(event.pos)
                case pygame.MOUSEWHEEL:
                    self._scroll(pygame.mouse.get_pos(), -event.y)
                case pygame.WINDOWFOCUSLOST:
                    self._controls.let_go()
                case pygame.QUIT:
                    self._controls.close()
                case pygame.VIDEORESIZE | pygame.WINDOWEXPOSED:
                    pass
                case _:
                    continue
            seen = True
        if self._controls.why:
            self._controls.why = False
            calls = self._insight.scene.calls
            self._explain(calls[-1] if calls else None)
        return seen

    def _key(self, event: pygame.event.Event) -> None:
        self._told_off()
        shift = bool(event.mod & pygame.KMOD_SHIFT)
        # On most keyboards ? is another key with SHIFT.
        key = pygame.K_QUESTION if getattr(event, "unicode", "") == "?" else event.key
        if key == pygame.K_ESCAPE and self._explainer.card is not None:
            self._explainer.close()
        elif not self.choices.press(key, self._players, shift=shift):
            self._notice = deciding.refused_key(key, self._insight)
            self._controls.press(key, self._players, shift=shift)

    def _click(self, place: tuple[int, int]) -> None:
        shown, choices = self._shown, self.choices
        if shown is None:
            return
        self._told_off()
        overlay, button, tab = (
            shown.layout.overlay_at(place),
            shown.layout.button_at(place),
            shown.layout.tab_at(place),
        )
        heading, call = shown.heading_at(place), shown.call_at(place)
        if self._explainer.card is not None and button is None and call is None:
            self._explainer.close()
        elif overlay is not None:
            choices.toggle(overlay)
        elif button is not None:
            self._notice = deciding.press(button, self._controls, self._insight, choices.selected)
        elif tab is not None:
            choices.tab = tab
        elif call is not None:
            self._explain(call)
        elif heading is not None and choices.tab is Tab.STREAMS:
            choices.sort_by(heading)
        elif (name := shown.name_at(place)) is not None:
            choices.select(name)

    def _scroll(self, place: tuple[int, int], steps: int) -> None:
        if self._shown is None or not self._shown.layout.panel.collidepoint(place):
            return
        part = None if place[1] < self._shown.layout.players.bottom else self.choices.tab
        rows, visible = self._shown.lengths.get(part, (0, 0))
        self.choices.scroll(part, 3 * steps if visible > 1 else steps, rows - visible)

    def _told_off(self) -> None:
        """What the user was told before is over with the next thing that the user does."""
        self._notice = ""
        self._hearing.forget_refusal()

    def _explain(self, call: Call | None) -> None:
        """Show why a call was made; None shows the field again."""
        self._explainer.ask(call, self._insight.scene.game)

    def _draw(self, tick: Tick, *, asked: bool) -> None:
        choices, controls = self.choices, self._controls
        drawn = [kind for overlay, kinds in DRAWN.items() if overlay in choices.shown for kind in kinds]
        selected = choices.selected if choices.tab is Tab.PLAYER else None
        self._insight = self._hearing.insight(tick.time, live=tick.live, drawn=drawn, selected=selected)
        window = pygame.display.get_surface()
        if window is None or self._painter is None:
            return
        if controls.whole_screen:
            controls.whole_screen = False
            toggle_whole_screen()
        self._shown = self._painter.draw(
            window,
            self._insight,
            self.choices,
            driving=controls.driving,
            notice=self._notice,
            card=self._explainer.card,
            keys=controls.help,
            panel=asked or self._frames % PANEL_EVERY == 0,
        )
        self._frames += 1
        pygame.display.flip()
        if controls.picture:
            controls.picture = False
            save_numbered(window, self._run or Path())
