"""The rules by which people drive robots by hand, in every window and on the page. This needs no window and no gamepad.

A person holds a player by a lease that each command renews. It ends as soon as the person gives the player back, and
LEASE later if commands stop coming, as when the process or the link dies: the player then plays on by itself.
"""

import math
from dataclasses import dataclass, field
from typing import Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Manual
from vrg.bus.pacing import LEASE, lease, match_speed
from vrg.bus.topics import Keys

TAKEN: Final = "Another person drives {}."
ECHO: Final = 0.5
"""The match time in s after giving a player back for which it may still report that a person drives it."""
SLOW: Final = 0.5
"""The part of a robot's speed that it is driven with while SHIFT or the turbo button is not held."""
SILENCE: Final = 15.0
"""The real time in s without an event of a gamepad after which nobody holds it. A stick is never quiet for so long; who
drives by buttons alone presses them again."""
DEAD_ZONE: Final = 0.15
"""The deflection of a stick below which it does not count, 0 to 1."""


@dataclass(frozen=True)
class Hands:
    """The state of a person's controls at one instant.

    Args:
        forward, turn, climb: -1 to 1: ahead, to the left, and up.
        enabled: the dead-man's switch is held. Without it the driven player stands.
        turbo: full speed is asked for.
    """

    forward: float = 0.0
    turn: float = 0.0
    climb: float = 0.0
    enabled: bool = False
    turbo: bool = False

    @property
    def shares(self) -> tuple[float, float, float]:
        """The parts of the robot's top speed, top turn rate and top climb that are asked for, each -1 to 1."""
        share = 0.0 if not self.enabled else 1.0 if self.turbo else SLOW
        forward, turn, climb = (max(-1.0, min(1.0, own)) * share for own in (self.forward, self.turn, self.climb))
        return forward, turn, climb


def radial(x: float, y: float) -> tuple[float, float]:
    """The position of a stick with a round dead zone, scaled so that it grows from 0 at the zone's border to 1."""
    length = math.hypot(x, y)
    if length <= DEAD_ZONE:
        return 0.0, 0.0
    scale = min(1.0, (length - DEAD_ZONE) / (1.0 - DEAD_ZONE)) / length
    return x * scale, y * scale


@dataclass
class Driving:
    """Publishes the commands for the player that one person drives.

    Args:
        mailbox: where messages are published. keys: of the match.

    Attributes:
        player: that is driven by hand; None while there is none.
    """

    mailbox: Mailbox
    keys: Keys
    player: str | None = None
    _commanded: float = field(default=-math.inf, repr=False)
    _given_back: dict[str, float] = field(default_factory=dict, repr=False)

    def taken(self, player: str, *, manual: bool) -> bool:
        """True if another person drives a player; `manual` is True if it reports that a person does."""
        given_back = self._given_back.get(player, -math.inf)
        return manual and player != self.player and self.mailbox.now > given_back + ECHO

    def take(self, player: str | None) -> None:
        """Drive a player from now on, and give back the one that was driven before; None drives no player."""
        if player != self.player:
            self.give_back()
        self.player = player

    def command(self, shares: tuple[float, float, float], rate: float) -> None:
        """Renew the lease. This is to be called at each tick while the match clock runs.

        Args:
            shares: as `Hands.shares`.
            rate: match seconds per real second; 0 means as fast as possible.
        """
        if self.player is not None:
            forward, turn, climb = shares
            manual = Manual(forward=forward, turn=turn, climb=climb, lease=lease(rate))
            self.mailbox.publish(self.keys.manual(self.player), manual)
            self._commanded = self.mailbox.now

    def lapsed(self, rate: float) -> bool:
        """True if the driven player has had no command for LEASE seconds of real time, so that it plays by itself.

        At a rate of 0 nobody knows how long that is: its lease alone ends.
        """
        if self.player is None or rate <= 0.0:
            return False
        return self.mailbox.now - self._commanded > LEASE * match_speed(rate)

    def give_back(self) -> None:
        """Let the player play by itself again, at once."""
        if self.player is not None:
            self.mailbox.publish(self.keys.manual(self.player), Manual(forward=0.0, turn=0.0, lease=0.0))
            self._given_back[self.player] = self.mailbox.now
        self.player = None
