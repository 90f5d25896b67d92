"""What somebody sees who watches a match for the first time, as numbers: how soon it shows what it is about.

An author of a game measures the default match with it, in one process:

    audience = MatchWatcher(setup)
    in_process.play(setup, journal, watchers=[audience])
    audience.seen.first("tag")
"""

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Final

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Call, RefereeState, Stage
from vrg.bus.node import Node, Tick
from vrg.config.setup import MatchSetup
from vrg.types import Vector

LOOKED: Final = 0.2
"""The match time in s between two looks."""
ABOUT: Final = {"sharks-and-minnows": "tag", "pursuit-evasion": "capture", "roboflag": "flag"}
"""The rule whose calls a game is about."""
SOON: Final = 60.0
"""The match time in s within which that is to be seen."""
MOVES: Final = 0.05
"""The speed in m/s from which a robot is seen to move."""


@dataclass
class Seen:
    """What was seen of a match. All times are match times in s, as somebody who watches counts them.

    Attributes:
        calls: when each call of the referee was made, and its rule.
        still: the longest time without a call in which no robot has moved.
        quiet: the longest time without a call, from the first one to the last one.
        waited: the longest time for which the match has waited for something.
        length: the time from the beginning to the end of the game. over: it has ended.
        winner: the winning team, or `draw`; None before the end.
    """

    calls: list[tuple[float, str]] = field(default_factory=list)
    still: float = 0.0
    quiet: float = 0.0
    waited: float = 0.0
    length: float = 0.0
    over: bool = False
    winner: str | None = None

    def first(self, *rules: str) -> float:
        """When the first call of one of these rules was made; infinite if there was none."""
        return next((time for time, rule in self.calls if rule in rules), math.inf)

    def count(self, *rules: str) -> int:
        """The number of calls of these rules."""
        return sum(rule in rules for _, rule in self.calls)


class MatchWatcher(Node):
    """Watches a match.

    Args:
        setup: of the match. ignored: the rules of calls that say nothing to somebody who watches.

    Attributes:
        seen: what was seen so far.
    """

    kind = "spectator"

    def __init__(self, setup: MatchSetup, ignored: Collection[str] = ()) -> None:
        mailbox = Mailbox()
        super().__init__("audience", mailbox, LOOKED)
        keys = setup.keys
        self._state, self._poses = mailbox.subscribe(keys.referee_state), mailbox.subscribe(keys.poses)
        self._calls = mailbox.subscribe(keys.referee_event)
        self._ignored = ignored
        self.seen = Seen()
        self._places: dict[str, Vector] = {}
        self._stirred = self._called = self._went_on = 0.0

    def tick(self, tick: Tick) -> None:
        """Take in what is new."""
        if self.seen.over:
            return
        now = tick.time
        for call in (received.body for received in self._calls.take()):
            self._hear(call, now)
        if poses := self._poses.take():
            places = {body.name: (body.pose.x, body.pose.y) for body in poses[-1].body.bodies}
            if any(math.dist(place, self._places.get(n, place)) > MOVES * LOOKED for n, place in places.items()):
                self._stirred = now
            self._places = places
        if states := self._state.take():
            self._read(states[-1].body, now)
        self.seen.still = max(self.seen.still, now - self._stirred)
        self.seen.waited = max(self.seen.waited, now - self._went_on)
        self.seen.length = now

    def _hear(self, call: Call, now: float) -> None:
        if call.rule in self._ignored:
            return
        if self.seen.calls:
            self.seen.quiet = max(self.seen.quiet, now - self._called)
        self.seen.calls.append((now, call.rule))
        self._called = self._stirred = now

    def _read(self, state: RefereeState, now: float) -> None:
        if not state.waiting:
            self._went_on = now
        self.seen.over = state.stage == Stage.GAME_OVER
        self.seen.winner = state.winner
