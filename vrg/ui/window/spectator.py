"""The spectator's window. It shows the match, and lets a human stop it, halt it, or drive a player."""

import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import ClassVar, Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import EstopRelease, Official, OfficialAction, Stage
from vrg.bus.node import Tick
from vrg.bus.topics import Keys
from vrg.regions import Region
from vrg.ui.acts import OFFICIALS, Act, Press
from vrg.ui.banner import CLOSE, Help
from vrg.ui.window.explaining import Explain
from vrg.ui.window.replay import OPENING
from vrg.ui.window.text import Fonts
from vrg.ui.window.window_node import WindowNode

OVER: Final = f"{CLOSE}, ESC shows the field"
AGAIN: Final = f"ENTER watches it again, {OVER}"
HOLD: Final = 100
"""The number of ticks for which the window stays while the replay is opened, if nobody stops it before: about 3 s."""
REFUSED: Final = "Only an official's seat may do that."
_DECISIONS: Final[Mapping[Act | None, OfficialAction]] = {
    Act.HALT: OfficialAction.HALT,
    Act.CONTINUE: OfficialAction.RESUME,
    Act.RECOVER: OfficialAction.RECOVER,
}


class Spectator(WindowNode):
    """Shows the match in a window.

    Args:
        name, mailbox, keys, sizes, obstacles, size, run, explain: as for WindowNode.
        again: returns the file that asks to watch the match again; None if nothing would answer. The window then stays
            until it is stopped, or for HOLD ticks, so that there is something to see until the replay draws.
        official: False if its user has not the seat of an official, and may only watch and stop everything.
    """

    kind: ClassVar[str] = "spectator"
    meanings: ClassVar[Mapping[Act, str]] = {
        Act.NEXT: "drive the next player", Act.PREVIOUS: "drive the previous one", Act.MANUAL: "drive, give it back",
        Act.TAKE: "watch it again",
    }  # fmt: skip

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
        official: bool = True,
    ) -> None:
        super().__init__(
            name, mailbox, keys, keys.match, sizes=sizes, obstacles=obstacles, size=size, run=run, explain=explain
        )
        self.show_calls(Fonts(), Help.KEYS if official else Help.NONE)
        self.acts |= {**dict.fromkeys(OFFICIALS, self._decide), Act.TAKE: self._watch_again}
        if not official:
            refused = OFFICIALS | {Act.NEXT, Act.PREVIOUS, Act.MANUAL}
            self.acts |= dict.fromkeys(refused, self._refuse)
            self.unlisted = refused | {Act.STEER, Act.CLIMB}
        self._official = official
        # Another window of this match gets answers of its own.
        self._answers_to = f"window-{secrets.token_hex(4)}"
        self._again = again
        self._over: str | None = None
        self._held: int | None = None

    @property
    def drivable(self) -> Sequence[str]:
        """All players, for an official."""
        return [player.name for player in self.scene.players] if self._official else []

    def take_in(self, tick: Tick) -> None:
        """Take in the messages that arrived, and tell the user why the referee has refused something."""
        for call in self._inlets.feed(self._builder):
            if call.rule == "refused" and call.answers == self._answers_to:
                self.notice = f"Refused: {call.why or call.text}"

    def tick(self, tick: Tick) -> None:
        """Do what every window does; while the replay is opened, wait for it."""
        super().tick(tick)
        if self._held is not None:
            self._held -= 1
            if self._held <= 0:
                self.close()

    def draw(self, window: pygame.Surface, tick: Tick) -> None:
        """Draw the match."""
        if self.scene.stage is Stage.GAME_OVER and self._over is None:
            self._over = OVER if self._again() is None else AGAIN
        self.paint(window, self.driving.player, self._over or "")

    def _decide(self, press: Press) -> None:
        if press.act is Act.RELEASE:
            self.mailbox.publish(self._keys.estop_release, EstopRelease(by=self._by))
        else:
            asked = Official(action=_DECISIONS[press.act], by=self._by, id=self._answers_to)
            self.mailbox.publish(self._keys.official, asked)

    def _refuse(self, _press: Press) -> None:
        self.notice = REFUSED

    def _watch_again(self, _press: Press) -> None:
        if self._over is None or (file := self._again()) is None:
            return
        try:
            file.touch()
        except OSError as error:
            self.notice = f"The match cannot be shown again: {error}"
        else:
            self._held, self._over, self.notice = HOLD, OPENING, OPENING
