"""A player's messages as a member of its team: the commander's orders, and the players that the team sees."""

import logging
from collections.abc import Sequence

from msgspec import structs

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState, Sight
from vrg.bus.node import is_fresh
from vrg.bus.topics import Keys
from vrg.shared import shared

SIGHT_TIMEOUT = 0.25
"""The match time in s by which the poses that a team sees may be older than the state of the referee."""
log = logging.getLogger(__name__)


class TeamChannel:
    """The subscriptions of one player to its team's messages.

    Args:
        keys: the keys of the match. mailbox: the mailbox of the player's node.
        name: the player's name. team: its team.
    """

    def __init__(self, keys: Keys, mailbox: Mailbox, name: str, team: str) -> None:
        self._name = name
        self._orders = mailbox.subscribe(keys.order(team))
        self._sight = mailbox.subscribe(keys.sight(team))
        self._unknown: str | None = None

    def seen(self, state: RefereeState, stamp: float) -> RefereeState:
        """The referee's state of match time `stamp`, with the poses that only this team receives.

        In a match without a limited view there are none. Poses that are older than the state do not count.
        """
        sight = self._sight.latest
        fresh = sight is not None and is_fresh(sight.stamp, stamp, SIGHT_TIMEOUT)
        return _with_poses(state, sight.body) if sight is not None and fresh else state

    def priority(self, now: float, known: Sequence[str]) -> str | None:
        """The order of the person who commands the team at match time `now`, if it is one of the known priorities."""
        order = self._orders.latest
        if order is None or order.body.priority is None or not is_fresh(order.stamp, now, order.body.lease):
            return None
        wanted = order.body.priority
        if wanted in known:
            return wanted
        if wanted != self._unknown:
            self._unknown = wanted
            expected = ", ".join(known) or "none"
            log.warning("%s: expected one of the strategy's priorities (%s), got %r", self._name, expected, wanted)
        return None


@shared
def _with_poses(state: RefereeState, sight: Sight) -> RefereeState:
    poses = sight.poses
    return structs.replace(state, players=tuple(structs.replace(p, pose=poses.get(p.name)) for p in state.players))
