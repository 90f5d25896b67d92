"""A commander's choices: the priority of the team, and the player that is driven. This needs no window.

While no player is driven, one of the buttons A, B, X and Y sets the priority of the team, and the same one again ends
it. A player button, which is an arrow of the directional pad, drives a player by hand; the same one again gives back.
Players beyond the fourth are on further pages: the page is that of the driven player.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import TeamOrder
from vrg.bus.topics import Keys
from vrg.games.game import Priority
from vrg.ui.driving import Driving

ORDER_LEASE: Final = 1.0
"""The match time in s that a priority holds."""
BUTTONS: Final = 4


@dataclass
class Deck:
    """Takes buttons in and publishes messages.

    Args:
        mailbox: where messages are published. keys: of the match. team: the team that is commanded.
        driving: the hold on the player that is driven.

    Attributes:
        priorities: those of the game. players: the names of the team's players.
        priority: the name of the priority that is set; None while there is none.
    """

    mailbox: Mailbox
    keys: Keys
    team: str
    driving: Driving
    priorities: Sequence[Priority] = ()
    players: Sequence[str] = ()
    priority: str | None = None
    _ordered: bool = field(default=False, repr=False)

    @property
    def selected(self) -> str | None:
        """The player that is driven by hand; None while there is none."""
        return self.driving.player

    @property
    def page(self) -> int:
        """The number of the page of players that is shown, from 0."""
        return self.players.index(self.selected) // BUTTONS if self.selected in self.players else 0

    @property
    def shown(self) -> Sequence[str]:
        """The players on this page, one for each player button."""
        return self.players[self.page * BUTTONS : (self.page + 1) * BUTTONS]

    def order(self, index: int) -> None:
        """Take in that one of the four buttons was pressed. While a player is driven, they set nothing."""
        if self.selected is None and index < len(self.priorities):
            wanted = self.priorities[index].name
            self.priority = None if self.priority == wanted else wanted

    def send(self) -> None:
        """Publish the priority. This is to be called at each tick."""
        if self.priority not in [priority.name for priority in self.priorities]:
            self.priority = None
        if self.priority is not None or self._ordered:
            self._ordered = self.priority is not None
            order = TeamOrder(priority=self.priority, lease=ORDER_LEASE)
            self.mailbox.publish(self.keys.order(self.team), order)

    def close(self) -> None:
        """End the priority."""
        self.priority = None
        self.send()
