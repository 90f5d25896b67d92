"""The messages of a player of RoboFlag: its target to its team, its bid to the referee, and its goal to spectators."""

import math
from collections.abc import Mapping

from vrg.agents.strategy import View
from vrg.bus.messages import Stroke
from vrg.games.roboflag.situation import Situation
from vrg.types import Vector

CLAIM = 1.0
"""The match time in s for which an announced target of a team mate counts."""
REPEAT_PERIOD = 0.8
"""The match time in s after which a player announces its target again."""
BID_AGAIN = 0.25
"""The match time in s after which a player bids again that does not find its bid in the referee's state."""
SKETCH = 0.5
"""The match time in s between two sketches."""


class Talk:
    """The messages that one player has sent and received.

    Args:
        name: the player's name.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._said: dict[str, tuple[float, str]] = {}
        self._bid_at = -math.inf
        self._sketch_at = -math.inf

    def targets(self, view: View) -> Mapping[str, str]:
        """The lately announced targets of the team's players, by player, with the messages of this tick."""
        for heard in view.heard:
            words = heard.words
            if isinstance(words, dict) and isinstance(words.get("target"), str):
                self._said[heard.speaker] = (heard.stamp, words["target"])
        return {name: target for name, (time, target) in self._said.items() if 0.0 <= view.time - time <= CLAIM}

    def claim(self, view: View, target: str | None) -> dict[str, str] | None:
        """The message about the player's target; None if there is nothing new."""
        time, before = self._said.get(self._name, (-math.inf, ""))
        if target is None or (target == before and 0.0 <= view.time - time < REPEAT_PERIOD):
            return None
        self._said[self._name] = (view.time, target)
        return {"target": target}

    def bids(self, view: View, s: Situation) -> dict[str, float]:
        """Its bid, as long as the referee does not know one: the time in s that it needs straight to the flag."""
        auction = s.auction
        if auction is None or auction.winner is not None or self._name not in auction.bidders:
            return {}
        if self._name in auction.bids or 0.0 <= view.time - self._bid_at < BID_AGAIN:
            return {}
        self._bid_at = view.time
        return {auction.lot: math.dist(view.position, s.ground.their_flag) / view.robot.v_max}

    def sketch(self, view: View, goal: Vector | None) -> list[Stroke] | None:
        """A line to where it wants to go; None if it is not yet time for another sketch."""
        if self._sketch_at - view.time >= 0.0:
            return None
        self._sketch_at = view.time + SKETCH
        return [] if goal is None else [Stroke(points=(view.position, goal))]
