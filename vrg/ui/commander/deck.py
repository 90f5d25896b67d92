"""What a commander's buttons mean, and the messages that follow. This needs no window and no gamepad.

A gamepad has four face buttons and four player buttons, which are its directional pad. While no player is selected, a
face button sets the priority of the team, and the same button again ends it. A player button selects a player, which is
then driven by hand; the same button again gives it back. Players beyond the fourth are on further pages.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Estop, Manual, TeamOrder
from vrg.bus.topics import Keys
from vrg.games.game import Priority
from vrg.ui.hands import LEASE, Hands

ORDER_LEASE: Final = 1.0
"""The match time in s that a priority holds."""
BUTTONS: Final = 4


@dataclass
class Deck:
    """Takes buttons in and publishes messages.

    Args:
        mailbox: where messages are published. keys: of the match.
        team: the team that is commanded. by: the name of who commands, for the log.

    Attributes:
        priorities: those of the game. players: the names of the team's players.
        selected: the player that is driven by hand; None while there is none.
        priority: the name of the priority that is set; None while there is none.
        page: the number of the page of players, from 0.
    """

    mailbox: Mailbox
    keys: Keys
    team: str
    by: str
    priorities: Sequence[Priority] = ()
    players: Sequence[str] = ()
    selected: str | None = None
    priority: str | None = None
    page: int = 0
    _ordered: bool = field(default=False, repr=False)

    @property
    def shown(self) -> Sequence[str]:
        """The players on this page, one for each player button."""
        return self.players[self.page * BUTTONS : (self.page + 1) * BUTTONS]

    def face(self, index: int) -> None:
        """Take in that a face button was pressed. While a player is driven, these buttons drive it and set nothing."""
        if self.selected is None and index < len(self.priorities):
            wanted = self.priorities[index].name
            self.priority = None if self.priority == wanted else wanted

    def player(self, index: int) -> None:
        """Take in that a player button was pressed."""
        if index >= len(self.shown):
            return
        before, wanted = self.selected, self.shown[index]
        self.release()
        if wanted != before:
            self.selected = wanted

    def turn_page(self) -> None:
        """Show the next four players."""
        pages = -(-len(self.players) // BUTTONS)
        self.page = (self.page + 1) % max(1, pages)

    def release(self) -> None:
        """Give the driven player back at once: it plays on by itself."""
        if self.selected is not None:
            self.mailbox.publish(self.keys.manual(self.selected), Manual(forward=0.0, turn=0.0, lease=0.0))
        self.selected = None

    def stop_all(self) -> None:
        """Engage the emergency stop of the match. Only an official releases it."""
        self.mailbox.publish(self.keys.estop, Estop(by=self.by))

    def send(self, hands: Hands) -> None:
        """Publish the priority and the command for the driven player. This is to be called at each tick."""
        if self.selected is not None and self.selected not in self.players:
            self.release()
        if self.priority not in [priority.name for priority in self.priorities]:
            self.priority = None
        if self.priority is not None or self._ordered:
            self._ordered = self.priority is not None
            order = TeamOrder(priority=self.priority, lease=ORDER_LEASE)
            self.mailbox.publish(self.keys.order(self.team), order)
        if self.selected is not None:
            forward, turn = hands.shares
            self.mailbox.publish(self.keys.manual(self.selected), Manual(forward=forward, turn=turn, lease=LEASE))

    def close(self) -> None:
        """Give everything back."""
        self.release()
        self.priority = None
        self.send(Hands())
