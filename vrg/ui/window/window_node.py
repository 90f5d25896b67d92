"""The base of the windows of a match that runs: what every one of them takes in, answers to and publishes, alike."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, Stage, shortened
from vrg.bus.node import Node, Tick
from vrg.bus.stopping import StopSignal
from vrg.bus.topics import Keys
from vrg.regions import Region
from vrg.ui.acts import HEARD, Act, Press
from vrg.ui.builder import SceneBuilder, SceneInlets
from vrg.ui.driving import TAKEN, Driving
from vrg.ui.pace import Pace
from vrg.ui.window.explaining import Explain
from vrg.ui.window.window_base import Window

log = logging.getLogger(__name__)

FRAME: Final = 1 / 30
"""The real time in s between two frames, and the match time in s between two driving commands."""
OVER: Final = "The match has ended: nobody hears this any more."
NOT_SENT: Final = "STOP NOT SENT: it is sent as soon as the match is heard again. Stop the robots by hand!"
STOPPED: Final = "Because of the emergency stop, {} is given back"
GIVEN_BACK: Final = "{} is given back"
LOST_PAD: Final = "The gamepad is lost: {} is given back"
HAND: Final = "You drive {}: arrows, or RB and stick; ESC gives it back"
NOBODY: Final = "There is nobody to drive now"
LED: Final = "The referee drives {} now; then it is yours"


class WindowNode(Window, Node):
    """A window that shows a match that runs. It opens at the first tick; closing it ends no match.

    Args:
        title: of the window. sizes: length and width of the robots, m, by name.
        obstacles: the ground that the map's walls and obstacles cover, m.
        players: those of which it may hear, where it may not hear the true poses; None if it hears everything.
        size: of the window, pixels; None fits the screen.
        run: the run folder, for pictures that the user takes; None if it is not on this machine.
        explain: works out why a call was made; None if what the run has left is not on this machine.
        by: who uses it, for the log.

    Attributes:
        driving: the hold on the player that the user drives.
        over: the match has ended for good; the window stays as it was left.

    Raises:
        LaunchError: at the first tick, there is no display.
    """

    def __init__(
        self,
        name: str,
        mailbox: Mailbox,
        keys: Keys,
        title: str,
        *,
        sizes: Mapping[str, tuple[float, float]] | None,
        obstacles: Sequence[Region],
        players: Sequence[str] | None = None,
        size: tuple[int, int] | None = None,
        run: Path | None = None,
        explain: Explain | None = None,
        by: str = "",
    ) -> None:
        Node.__init__(self, name, mailbox, FRAME)
        Window.__init__(self, f"VRG: {title}", size, run, explain)
        self.acts |= {
            Act.NEXT: self._drive_next,
            Act.PREVIOUS: self._drive_next,
            Act.MANUAL: self._drive,
            Act.STEER: lambda _: None,  # the arrows that are held are read at each tick
            Act.CLIMB: lambda _: None,  # as above
            Act.LEAVE: self._leave,
            Act.PAD_LOST: self._lose_pad,
            Act.PAD_UNKNOWN: self._name_unknown_pad,
        }
        self.driving = Driving(mailbox, keys)
        self.over = False
        self._ordered = False
        """An emergency stop was ordered here that nobody has reported yet."""
        self._keys = keys
        self._builder = SceneBuilder(sizes=sizes, obstacles=obstacles)
        self._inlets = SceneInlets(mailbox, keys, poses=players is None, players=players)
        self._by = shortened(by or name, 64)
        self._pace = Pace(FRAME)

    # What a subclass does.

    @property
    def drivable(self) -> Sequence[str]:
        """The players that can be driven here, in the order in which TAB goes through them."""
        raise NotImplementedError

    def take_in(self, tick: Tick) -> None:
        """Take in the messages that arrived."""
        raise NotImplementedError

    def steer(self, tick: Tick) -> None:
        """Publish what the user's hands ask for. This is called at each tick while the match clock runs."""
        self.driving.command(self.pads.hands.shares, self.scene.rate)

    def draw(self, window: pygame.Surface, tick: Tick) -> None:
        """Draw `scene` upon the window."""
        raise NotImplementedError

    # What all do.

    @property
    def stopped(self) -> bool:
        """True if the emergency stop is engaged."""
        return self.scene.estop

    @property
    def hand(self) -> str:
        """The notice, or else the line about driving a player."""
        player = self.driving.player
        if self.notice or player is None:
            return self.notice
        status = self.scene.player(player)
        return (LED if status is not None and status.leased else HAND).format(player)

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
            # It must not drive on by itself when the stop is released.
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
                self.draw(window, tick)
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
            self.acts |= dict.fromkeys(HEARD & self.acts.keys(), self._tell_that_it_is_over)
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
        if self._opened:
            self.pads.stop()
        super().close()

    def emergency_stop(self, _press: Press) -> None:
        """Stop the robots of the match."""
        self.mailbox.publish(self._keys.estop, Estop(by=self._by))
        self._ordered = True

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

    def _drive_next(self, press: Press) -> None:
        step = -1 if press.act is Act.PREVIOUS else 1
        before = self.driving.player
        free = [player for player in self.drivable if not self._taken(player)]
        if before in free:
            self.driving.take(free[(free.index(before) + step) % len(free)])
        elif free:
            self.driving.take(free[0 if step > 0 else -1])
        else:
            self.notice = TAKEN.format(", ".join(self.drivable)) if self.drivable else NOBODY

    def _drive(self, press: Press) -> None:
        if self.driving.player is None:
            self._drive_next(press)
        else:
            self.give_back(GIVEN_BACK.format(self.driving.player))

    def _leave(self, _press: Press) -> None:
        if self.driving.player is None:
            self.shows_result = False
            self.explain(None)
        self.give_back()

    def _lose_pad(self, _press: Press) -> None:
        if self.driving.player is not None:
            log.warning(LOST_PAD.format(self.driving.player))
            self.give_back(LOST_PAD.format(self.driving.player))

    def _name_unknown_pad(self, _press: Press) -> None:
        self.notice = self.pads.unknown

    def _tell_that_it_is_over(self, _press: Press) -> None:
        self.notice = OVER
