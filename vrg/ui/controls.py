"""Turns the spectator's key presses into messages. This needs no window, only the numbers of keys."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import pygame

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, EstopRelease, Manual, Official, OfficialAction
from vrg.bus.topics import Keys

LEASE: Final = 0.5
"""s of match time that a steering command holds: when this window dies the player plays on by itself."""

_AHEAD: Final = {pygame.K_UP: 1.0, pygame.K_DOWN: -1.0}
_ASIDE: Final = {pygame.K_LEFT: 1.0, pygame.K_RIGHT: -1.0}
_DECIDING: Final = (pygame.K_u, pygame.K_h, pygame.K_c, pygame.K_r, pygame.K_TAB)
"""The keys that only an official's window may use: the router would drop what they say from any other one."""


@dataclass
class Controls:
    """Takes keys in and publishes messages.

    Args:
        mailbox: where messages are published. keys: of the match. by: the name of who presses, for the log.
        official: False if the user may neither decide nor drive; the emergency stop may be engaged by everybody.

    Attributes:
        driving: the player that the user drives by hand, or None.
        quit: the user wants the window closed; the match goes on.
        picture: the user wants a picture of the window; whoever takes it sets this back.
        whole_screen: the user wants the window to change between whole screen and not; whoever does it sets this back.
        help: the keys are listed.
        why: the user wants to know why the last call was made; whoever tells sets this back.
    """

    mailbox: Mailbox
    keys: Keys
    by: str
    official: bool = True
    driving: str | None = None
    quit: bool = False
    picture: bool = False
    whole_screen: bool = False
    help: bool = False
    why: bool = False
    _held: set[int] = field(default_factory=set)

    def press(self, key: int, players: Sequence[str], *, shift: bool = False) -> None:
        """Take in that a key went down.

        Args:
            players: those that can be driven, in the order in which TAB goes through them.
            shift: SHIFT is held; TAB then goes backwards.
        """
        if key in _DECIDING:
            if self.official:
                self._decide(key, players, shift)
            return
        match key:
            case pygame.K_SPACE:
                self.mailbox.publish(self.keys.estop, Estop(by=self.by))
            case pygame.K_ESCAPE:
                self.give_back()
            case pygame.K_p:
                self.picture = True
            case pygame.K_w:
                self.why = True
            case pygame.K_F11:
                self.whole_screen = True
            case pygame.K_QUESTION | pygame.K_F1:
                self.help = not self.help
            case pygame.K_q | pygame.K_END:
                self.close()
            case _ if key in _AHEAD or key in _ASIDE:
                self._held.add(key)

    def release(self, key: int) -> None:
        """Take in that a key went up."""
        self._held.discard(key)

    def let_go(self) -> None:
        """Count no key as held: the keyboard went elsewhere, and the release of the keys will not be seen."""
        self._held.clear()

    def steer(self) -> None:
        """Publish the command for the player that is driven by hand. This is to be called at each tick."""
        if self.driving is None:
            return
        forward = sum(_AHEAD.get(key, 0.0) for key in self._held)
        turn = sum(_ASIDE.get(key, 0.0) for key in self._held)
        self.mailbox.publish(self.keys.manual(self.driving), Manual(forward=forward, turn=turn, lease=LEASE))

    def give_back(self) -> None:
        """Let the player that is driven by hand play by itself again."""
        if self.driving is not None:
            self.mailbox.publish(self.keys.manual(self.driving), Manual(forward=0.0, turn=0.0, lease=0.0))
        self.driving = None

    def close(self) -> None:
        """Close the window, as the user asked."""
        self.give_back()
        self.quit = True

    def decide(self, action: OfficialAction, subject: str | None = None) -> None:
        """Publish an official's decision; `subject` is the player that it is about. A router refuses it to others."""
        self.mailbox.publish(self.keys.official, Official(action=action, by=self.by, subject=subject))

    def _decide(self, key: int, players: Sequence[str], shift: bool) -> None:
        match key:
            case pygame.K_u:
                self.mailbox.publish(self.keys.estop_release, EstopRelease(by=self.by))
            case pygame.K_h:
                self.decide(OfficialAction.HALT)
            case pygame.K_c:
                self.decide(OfficialAction.RESUME)
            case pygame.K_r:
                self.decide(OfficialAction.RECOVER)
            case pygame.K_TAB:
                self._next(players, -1 if shift else 1)

    def _next(self, players: Sequence[str], step: int) -> None:
        before = self.driving
        self.give_back()
        if not players:
            return
        if before in players:
            self.driving = players[(players.index(before) + step) % len(players)]
        else:
            self.driving = players[0 if step > 0 else -1]
