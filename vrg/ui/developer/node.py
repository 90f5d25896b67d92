"""The developers' view as a node: it shows the whole match, and publishes what an official at it decides."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.bus.traffic import Traffic
from vrg.hal.models import RobotModel
from vrg.regions import Region
from vrg.ui.acts import Act, Press
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.developer.choices import Tab, ViewState
from vrg.ui.developer.deciding import ACTS, ON_PLAYER, Button, disabled_reason
from vrg.ui.developer.insight import Hearing, Insight
from vrg.ui.developer.painter import DeveloperPainter, Shown
from vrg.ui.developer.sensing import DRAWN
from vrg.ui.explaining import Explain
from vrg.ui.spectator import Spectator
from vrg.ui.window_node import FRAME, WindowNode

PANEL_EVERY: Final = 6
"""The panel is drawn anew at every so many frames, and when something was pressed."""


class DeveloperWindow(WindowNode):
    """Shows everything of a match in a window.

    Args:
        name, mailbox, keys, size, run, explain, official: as for WindowNode.
        traffic: counts what is heard. The runner of the node attaches it to the bus.
        robots: the models of the players' robots, by name. obstacles: the ground that walls and obstacles cover, m.
    """

    answers = (*(act for act in Spectator.answers if act is not Act.TAKE), Act.SELECT, Act.LAYER, Act.TAB)

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        traffic: Traffic,
        *,
        robots: Mapping[str, RobotModel] | None = None,
        obstacles: Sequence[Region] = (),
        size: tuple[int, int] | None = None,
        run: Path | None = None,
        explain: Explain | None = None,
        period: float = FRAME,
        official: bool = True,
    ) -> None:
        robots = dict(robots or {})
        sizes = {name: model.size for name, model in robots.items()}
        super().__init__(
            name, mailbox, keys, f"{keys.match}, developers' view",
            builder=SceneBuilder(sizes=sizes, obstacles=obstacles), inlets=SceneInlets(mailbox, keys), size=size,
            run=run, explain=explain, period=period, official=official,
        )  # fmt: skip
        self.traffic = traffic
        self.choices = ViewState()
        self._hearing = Hearing(mailbox, keys, traffic, robots, official=official)
        self._insight = Insight(official=official)
        self._painter = DeveloperPainter(robots)
        self._shown: Shown | None = None
        self._frames = 0

    @property
    def insight(self) -> Insight:
        """The insight that the window showed last."""
        return self._insight

    @property
    def shown(self) -> Shown | None:
        """The places in the window's last frame; None before the first."""
        return self._shown

    def take_in(self, tick: Tick) -> None:
        """Take in the messages that arrived."""
        self._hearing.take(tick.time, self._inlets.feed(self._builder))

    def press(self, press: Press) -> None:
        """Answer to a key or a button. What the referee refused before is over with it."""
        self._hearing.forget_refusal()
        super().press(press)

    def answer(self, press: Press) -> None:
        """Answer to one of the acts in `answers`."""
        if not self.choices.press(press, [player.name for player in self.scene.players]):
            super().answer(press)

    def click(self, place: tuple[int, int]) -> None:
        """Do what a button, a switch, a tab, a heading, a call or a player at a pixel is for."""
        shown, choices = self._shown, self.choices
        if shown is None:
            return
        self.notice = ""
        self._hearing.forget_refusal()
        overlay, button, tab = (
            shown.layout.overlay_at(place),
            shown.layout.button_at(place),
            shown.layout.tab_at(place),
        )
        heading, call = shown.heading_at(place), shown.call_at(place)
        if self.explainer.card is not None and button is None and call is None:
            self.explainer.close()
        elif overlay is not None:
            choices.toggle(overlay)
        elif button is not None:
            self._push(button)
        elif tab is not None:
            choices.tab = tab
        elif call is not None:
            self.explain(call)
        elif heading is not None and choices.tab is Tab.STREAMS:
            choices.sort_by(heading)
        elif (name := shown.name_at(place)) is not None:
            choices.select(name)

    def _push(self, button: Button) -> None:
        """Do what an official's button is for, or tell why not."""
        self.notice = disabled_reason(button, self._insight, self.choices.selected)
        if not self.notice and button in ACTS:
            super().press(Press(ACTS[button]))
        elif not self.notice:
            self.decide(ON_PLAYER[button], self.choices.selected)

    def scroll(self, place: tuple[int, int], steps: int) -> None:
        """Scroll the list at a pixel."""
        if self._shown is None or not self._shown.layout.panel.collidepoint(place):
            return
        part = None if place[1] < self._shown.layout.players.bottom else self.choices.tab
        rows, visible = self._shown.lengths.get(part, (0, 0))
        self.choices.scroll(part, 3 * steps if visible > 1 else steps, rows - visible)

    def draw(self, window: pygame.Surface, tick: Tick, *, asked: bool) -> None:
        """Draw what is known."""
        choices = self.choices
        drawn = [kind for overlay, kinds in DRAWN.items() if overlay in choices.shown for kind in kinds]
        selected = choices.selected if choices.tab is Tab.PLAYER else None
        self._insight = self._hearing.insight(tick.time, self.scene, drawn=drawn, selected=selected)
        self._shown = self._painter.draw(
            window,
            self._insight,
            choices,
            driving=self.driving.player,
            notice=self.hand,
            card=self.explainer.card,
            keys=self.listed,
            panel=asked or self._frames % PANEL_EVERY == 0,
        )
        self._frames += 1
