"""The strategies of RoboFlag, by the names that a match file may give a team (thesis 4.4.3 and 4.4.4)."""

import random
from collections.abc import Mapping

from vrg.agents.strategy import View
from vrg.games.roboflag import FLAGGED_SAFETY, HAIL_MARY, TAG_DEFENSE, TEAM_FLAG
from vrg.games.roboflag.player import RoboFlagPlayer
from vrg.games.roboflag.situation import Situation
from vrg.games.roboflag.tactics import ByNumbers, Everybody, GuardFlag, OneAttacker, Pair, Purge, ShieldCarrier, Tactic
from vrg.hal.models import RobotModel

PRIORITY_ORDERS: Mapping[str, Tactic] = {
    TEAM_FLAG: GuardFlag(),
    TAG_DEFENSE: Purge(),
    FLAGGED_SAFETY: ShieldCarrier(),
    HAIL_MARY: Everybody(),
}
"""The tactic of a team for each priority of the person who commands it."""


class TeamPlayer(RoboFlagPlayer):
    """A player that also follows the priorities of the person who commands its team."""

    orders = PRIORITY_ORDERS
    priorities = tuple(PRIORITY_ORDERS)


class Conservative(TeamPlayer):
    """One goes for the flag, the rest guard their own."""

    tactic = OneAttacker()


class Aggressive(TeamPlayer):
    """All go for the flag as one group, then shield the carrier."""

    tactic = Everybody()


class TwoGroups(TeamPlayer):
    """All go for the flag in two groups, one along each side of the field, then shield the carrier."""

    tactic = Everybody(flanks=2)


class Balanced(TeamPlayer):
    """Two go at the same time, one along each side of the field; the rest guard."""

    tactic = Pair()


class TeamFlag(TeamPlayer):
    """All guard their flag, and tag only the one that carries it."""

    tactic = PRIORITY_ORDERS[TEAM_FLAG]


class TagDefense(TeamPlayer):
    """All tag the opponents on their own half."""

    tactic = PRIORITY_ORDERS[TAG_DEFENSE]


class FlaggedSafety(TeamPlayer):
    """By numbers, and all shield the carrier."""

    tactic = PRIORITY_ORDERS[FLAGGED_SAFETY]


class HailMary(TeamPlayer):
    """All go for the flag: the same as aggressive, under the name of the priority."""

    tactic = PRIORITY_ORDERS[HAIL_MARY]


class Mixed(TeamPlayer):
    """Draws one of several tactics again for each epoch of the auction, with the chances of `chances`.

    A subclass with other chances is a new strategy. All players of a team draw the same, from the seed of the match.

    Attributes:
        chances: the tactics and the weight of each.
    """

    tactic = OneAttacker()
    chances: tuple[tuple[Tactic, float], ...] = ((OneAttacker(), 0.5), (ByNumbers(), 0.25), (Everybody(2), 0.25))

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._epoch: tuple[int, float] | None = None
        self._drawn = self.tactic

    def choose(self, view: View, s: Situation) -> Tactic:
        """The tactic that was drawn for this epoch, if no person commands the team."""
        epoch = None if s.auction is None else (s.round, s.auction.opened)
        if epoch is not None and epoch != self._epoch:
            self._epoch = epoch
            source = random.Random(f"{self.seed} {epoch}")
            tactics, weights = zip(*self.chances, strict=True)
            self._drawn = source.choices(tactics, weights)[0]
        return self.orders.get(view.priority or "", self._drawn)
