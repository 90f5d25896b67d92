"""The spectator's window. It shows the match, and lets a human stop it, halt it, or drive a player."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Stage
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.regions import Region
from vrg.ui.acts import Act, Press
from vrg.ui.banner import Help
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.draw import Painter
from vrg.ui.explaining import Explain
from vrg.ui.panel import PanelPainter
from vrg.ui.replay import OPENING
from vrg.ui.text import Fonts
from vrg.ui.window_node import FRAME, WindowNode

OVER: Final = "Q closes the window, ESC shows the field"
AGAIN: Final = "ENTER watches it again, Q closes the window, ESC shows the field"
HOLD: Final = 100
"""The number of ticks for which the window stays while the replay is opened, if nobody stops it before: about 3 s."""


class Spectator(WindowNode):
    """Shows the match in a window.

    Args:
        name, mailbox, keys, size, run, explain, official: as for WindowNode.
        sizes: length and width of the robots in m, by name.
        obstacles: the ground that the map's walls and obstacles cover, m.
        again: returns the file that asks to watch the match again; None if nothing would answer. The window then stays
            until it is stopped, or for HOLD ticks, so that there is something to see until the replay draws.
    """

    answers = (
        Act.RELEASE, Act.HALT, Act.CONTINUE, Act.RECOVER, Act.NEXT, Act.PREVIOUS, Act.MANUAL, Act.STEER, Act.LEAVE,
        Act.WHY, Act.PLANS, Act.TAKE,
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        *,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        obstacles: Sequence[Region] = (),
        size: tuple[int, int] | None = None,
        run: Path | None = None,
        explain: Explain | None = None,
        again: Callable[[], Path | None] = lambda: None,
        period: float = FRAME,
        official: bool = True,
    ) -> None:
        builder = SceneBuilder(sizes=sizes, obstacles=obstacles)
        super().__init__(
            name, mailbox, keys, keys.match, builder=builder, inlets=SceneInlets(mailbox, keys), size=size, run=run,
            explain=explain, period=period, official=official,
        )  # fmt: skip
        self._again = again
        self._over: str | None = None
        self._held: int | None = None
        fonts = Fonts()
        self._panel = PanelPainter(fonts)
        self._painter = Painter(fonts, self._panel, help_=Help.KEYS if official else Help.NONE)

    def click(self, place: tuple[int, int]) -> None:
        """Explain the call at a pixel; elsewhere show the field again."""
        self.explain(self._panel.call_at(place))

    def scroll(self, place: tuple[int, int], steps: int) -> None:
        """Scroll the calls."""
        self._panel.scroll(place, steps)

    def answer(self, press: Press) -> None:
        """Answer to one of the acts in `answers`."""
        if press.act is Act.PLANS:
            self.notice = self._painter.switch_plans(self.scene)
        elif press.act is not Act.TAKE:
            if press.act is Act.LEAVE and self._over and self.driving.player is None:
                self._over = ""
            super().answer(press)
        elif self._over is not None and (file := self._again()) is not None:
            try:
                file.touch()
            except OSError as error:
                self.notice = f"The match cannot be shown again: {error}"
            else:
                self._held = HOLD

    def tick(self, tick: Tick) -> None:
        """Do what every window does; while the replay is opened, wait for it."""
        super().tick(tick)
        if self._held is not None:
            self._held -= 1
            if self._held <= 0:
                self.close()

    def draw(self, window: pygame.Surface, tick: Tick, *, asked: bool) -> None:
        """Draw the match."""
        if self.scene.stage is Stage.GAME_OVER and self._over is None:
            self._over = OVER if self._again() is None else AGAIN
        hand, over = self.hand, self._over or ""
        if self._held is not None:
            hand, over = OPENING, OPENING if over else ""
        self._painter.draw(
            window, self.scene, self.driving.player, hand=hand, keys=self.listed, card=self.explainer.card, over=over,
        )  # fmt: skip
