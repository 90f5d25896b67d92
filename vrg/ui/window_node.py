"""The base of the windows of a match: what every one of them takes in, answers to and publishes, in the same way."""

import logging
import secrets
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call, Estop, EstopRelease, Official, OfficialAction, Stage, shortened
from vrg.bus.node import Node, Tick
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Keys
from vrg.ui.acts import Act, Press, listed
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.driving import TAKEN, Driving
from vrg.ui.explaining import Explain, Explainer
from vrg.ui.pace import Pace
from vrg.ui.pads import Pads
from vrg.ui.scene import Scene
from vrg.ui.window import Window

log = logging.getLogger(__name__)

FRAME: Final = 1 / 30
"""The real time in s between two frames, and the match time in s between two driving commands."""
REFUSED: Final = "Only an official's seat may do that."
OVER: Final = "The match has ended: nobody hears this any more."
NOT_SENT: Final = "STOP NOT SENT: it is sent as soon as the match is heard again. Stop the robots by hand!"
STOPPED: Final = "Because of the emergency stop, {} is given back"
LOST_PAD: Final = "The gamepad is lost: {} is given back"
HAND: Final = "You drive {}: arrows, or RB and stick; ESC gives it back"
LED: Final = "The referee drives {} now; then it is yours"

_DECISIONS: Final = {
    Act.HALT: OfficialAction.HALT,
    Act.CONTINUE: OfficialAction.RESUME,
    Act.RECOVER: OfficialAction.RECOVER,
}
OFFICIALS: Final = frozenset({*_DECISIONS, Act.RELEASE})
"""The acts that need an official's seat: a router refuses them to others."""


class WindowNode(Window, Node):
    """A window that shows a match that runs. It opens at the first tick; closing it ends no match.

    Args:
        title: of the window. builder, inlets: what makes scenes, and of which messages.
        size: of the window, pixels; None fits the screen.
        run: the run folder, for pictures that the user takes; None if it is not on this machine.
        explain: works out why a call was made; None if what the run has left is not on this machine.
        by: who uses it, for the log. official: whether it has an official's seat.

    Attributes:
        answers: the acts that this window answers to, as they are listed behind `?`.
        scene: what the window showed last. driving: the hold on the player that the user drives.
        pads: the gamepads and the keyboard. over: the match has ended for good; the window stays as it was left.
        notice: what the user must read, until the next thing that the user does.

    Raises:
        LaunchError: at the first tick, there is no display.
    """

    kind: ClassVar[str] = "spectator"
    answers: ClassVar[tuple[Act, ...]] = ()

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        title: str,
        *,
        builder: SceneBuilder,
        inlets: SceneInlets,
        size: tuple[int, int] | None = None,
        run: Path | None = None,
        explain: Explain | None = None,
        period: float = FRAME,
        by: str = "",
        official: bool = True,
    ) -> None:
        Node.__init__(self, name, mailbox, period)
        Window.__init__(self, f"VRG: {title}", size, run)
        self.scene = Scene()
        self.driving = Driving(mailbox, keys)
        self.pads = Pads()
        self.notice = ""
        self.over = False
        self.official = official
        self._ordered = False
        """An emergency stop was ordered here that nobody has reported yet."""
        self.explainer = Explainer(explain)
        self._keys = keys
        self._builder = builder
        self._inlets = inlets
        self._by = shortened(by or name, 64)
        # Another window of this match gets answers of its own.
        self._answers_to = f"window-{secrets.token_hex(4)}"
        self._pace = Pace(FRAME)

    @property
    def drivable(self) -> Sequence[str]:
        """The players that can be driven here, in the order in which TAB goes through them."""
        return [player.name for player in self.scene.players] if self.official and not self.over else []

    @property
    def stopped(self) -> bool:
        """True if the emergency stop is engaged."""
        return self.scene.estop

    @property
    def hand(self) -> str:
        """The notice that the user must read, or else the line about driving a player."""
        player = self.driving.player
        if self.notice or player is None:
            return self.notice
        status = self.scene.player(player)
        return (LED if status is not None and status.leased else HAND).format(player)

    @property
    def listed(self) -> Sequence[tuple[str, str]]:
        """The keys to list now; empty while they are not asked for."""
        shown = (Act.STOP, *self.answers, Act.PICTURE, Act.SCREEN, Act.HELP, Act.CLOSE)
        return listed(act for act in shown if self.official or act not in OFFICIALS) if self.help else []

    # -- what a subclass does

    def take_in(self, tick: Tick) -> None:
        """Take in the messages that arrived, and tell the user why the referee has refused something."""
        for call in self._inlets.feed(self._builder):
            if call.rule == "refused" and call.answers == self._answers_to:
                self.notice = f"Refused: {call.why or call.text}"

    def steer(self, tick: Tick) -> None:
        """Publish what the user's hands ask for. This is called at each tick while the match clock runs."""
        self.driving.command(*self.pads.hands.shares, self.scene.rate)

    def draw(self, window: pygame.Surface, tick: Tick, *, asked: bool) -> None:
        """Draw `scene` upon the window; `asked` is True where the user has just done something."""
        raise NotImplementedError

    # -- what all do

    def tick(self, tick: Tick) -> None:
        """Take in messages and events, publish what the user wants, and draw at most one frame."""
        if self.closed:
            return
        if not self._opened:
            self.open()
            self.pads.start()
        if not self.over:
            self.take_in(tick)
        asked = self.handle_events() | self.explainer.look()
        self._watch_stop(tick)
        if self.closed:
            return
        player = self.driving.player
        if player is not None and self.stopped:
            # So that it does not drive on by itself when the stop is released.
            self.give_back(STOPPED.format(player))
        elif player is not None and player not in self.drivable:
            self.give_back()
        if tick.live and not self.over:
            self.steer(tick)
        else:
            self.pads.let_go()  # nobody's robot drives on because its driver did not notice
        if self._pace.due(tick, self.scene.rate) or asked:
            self.scene = replace(self._builder.build(tick.live or self.over), left=self.over)
            window = pygame.display.get_surface()
            if window is not None:
                self.draw(window, tick, asked=asked)
                self.show()

    def _watch_stop(self, tick: Tick) -> None:
        """Show that an emergency stop was not sent. The session keeps it, and publishes it when the link is back."""
        # Without a clock it is not known any more whether the stop that was reported last is still engaged.
        if self._ordered and ((tick.live and self._builder.latched) or self.over):
            self._ordered = False
            self.notice = "" if self.notice == NOT_SENT else self.notice
        elif self._ordered and not tick.live:
            self.notice = NOT_SENT

    def has_ended(self, gone: bool) -> bool:
        """Return whether the match has ended for good; the window then takes nothing in any more.

        Args:
            gone: the match does not run any more, as far as that is known.
        """
        self._builder.one_match = True
        ended = gone or self._builder.other or (self.scene.stage is Stage.GAME_OVER and not self.scene.live)
        if ended and not self.over:
            self.over = True
            self.give_back()
        return self.over

    def linger(self, stop: StopSignal) -> None:
        """Show how a match was left that has ended, until the user closes the window or it is stopped."""
        while not self.closed and not stop.is_set():
            self.tick(Tick(self.scene.time, live=False))
            stop.wait(FRAME)
        self.close()

    def stop(self) -> None:
        """Give the driven player back, and close the window unless its match is over. Idempotent."""
        self.give_back()
        if not self.over:
            self.close()

    def close(self) -> None:
        """Give the driven player back and close the window. Calling it again does nothing."""
        self.give_back()
        self.explainer.close()
        if self._opened:
            self.pads.stop()
        super().close()

    def handle(self, event: pygame.event.Event) -> bool:
        """Answer to one event, also of a gamepad; return whether it should be seen at once."""
        held = event.type == pygame.KEYDOWN and event.key in self._down
        if event.type in (pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN) and not held:
            self.notice = ""
        press = None if self.typing and event.type == pygame.KEYDOWN else self.pads.take(event)
        if press is not None:
            self.press(press)
            return True
        return super().handle(event)

    def press(self, press: Press) -> None:
        """Answer to a key or a button."""
        self.notice = ""
        act = press.act
        if self.over and (act is Act.STOP or act in OFFICIALS):
            self.notice = OVER
        elif act is Act.STOP:
            self.mailbox.publish(self._keys.estop, Estop(by=self._by))
            self._ordered = True
        elif act is Act.PAD_LOST:
            self.lose_pad()
        elif act is Act.PAD_UNKNOWN:
            self.notice = self.pads.unknown
        elif act in self.answers:
            self.answer(press)

    def answer(self, press: Press) -> None:
        """Answer to one of the acts in `answers`."""
        act = press.act
        if act in OFFICIALS or (act in (Act.NEXT, Act.PREVIOUS, Act.MANUAL) and not self.drivable):
            self._decide(act)
        elif act in (Act.NEXT, Act.PREVIOUS):
            self._next(1 if act is Act.NEXT else -1)
        elif act is Act.MANUAL and self.driving.player is None:
            self._next(1)
        elif act in (Act.LEAVE, Act.MANUAL):
            if self.driving.player is None:
                self.explain(None)
            self.give_back()
        elif act is Act.WHY:
            self.explain(self.scene.calls[-1] if self.scene.calls else None)

    def take(self, player: str | None) -> None:
        """Drive a player by hand, unless another person does; None gives back the one that is driven."""
        if player is not None and self._taken(player):
            self.notice = TAKEN.format(player)
        else:
            self.driving.take(player)

    def _taken(self, player: str) -> bool:
        status = self.scene.player(player)
        return self.driving.taken(player, manual=status is not None and status.manual)

    def give_back(self, notice: str = "") -> None:
        """Let the driven player play by itself again; `notice` is what the user must read."""
        self.driving.give_back()
        self.notice = notice or self.notice

    def lose_pad(self) -> None:
        """Give the driven player back, because the gamepad in use is lost."""
        if self.driving.player is not None:
            log.warning(LOST_PAD.format(self.driving.player))
            self.give_back(LOST_PAD.format(self.driving.player))

    def tell(self, text: str) -> None:
        """Tell the user what has come of something."""
        self.notice = text

    def explain(self, call: Call | None) -> None:
        """Show why a call was made, in place of the keys; None shows the field again."""
        self.help = False
        self.explainer.ask(call, self.scene.game)

    def _decide(self, act: Act | None) -> None:
        if not self.official:
            self.notice = REFUSED
        elif act is Act.RELEASE:
            self.mailbox.publish(self._keys.estop_release, EstopRelease(by=self._by))
        elif act in _DECISIONS:
            asked = Official(action=_DECISIONS[act], by=self._by, id=self._answers_to)
            self.mailbox.publish(self._keys.official, asked)

    def _next(self, step: int) -> None:
        before = self.driving.player
        free = [player for player in self.drivable if not self._taken(player)]
        if not free:
            self.notice = TAKEN.format(", ".join(self.drivable))
        elif before in free:
            self.driving.take(free[(free.index(before) + step) % len(free)])
        else:
            self.driving.take(free[0 if step > 0 else -1])
