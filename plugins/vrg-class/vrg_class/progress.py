"""How far a try is from the goal of its step: a function of what the referee publishes and where bodies are."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from vrg.bus.messages import Body, Call, RefereeState
from vrg.geometry import wrap
from vrg.types import Pose
from vrg_class.lesson import Goal


@dataclass
class Progress:
    """Takes a match in, one instant after the other.

    Args:
        goal: of the step. team: the own team. own: the names of its players. others: those of all other players.

    Attributes:
        reached: the time of play at which the goal was reached, s; None as long as it is not.
        spoiled: why it cannot be reached any more: by a `call` of the rule that must not be, or as the `time` is over;
            empty while it can.
    """

    goal: Goal
    team: str
    own: Collection[str]
    others: Collection[str]
    reached: float | None = None
    spoiled: str = ""
    _calls: set[tuple[str, bool]] = field(default_factory=set)
    _printed: bool = False
    _poses: dict[str, Pose] = field(default_factory=dict)
    _ways: dict[str, float] = field(default_factory=dict)
    _turns: dict[str, float] = field(default_factory=dict)

    def take(self, state: RefereeState, bodies: Sequence[Body], calls: Sequence[Call], *, printed: bool) -> None:
        """Take an instant in.

        Args:
            state: of the referee. bodies: where everybody is. calls: those since the last instant.
            printed: whether the code has printed something since the last instant.
        """
        self._printed |= printed
        for body in bodies:
            if body.name in self.own:
                self._move(body.name, body.pose)
        for call in calls:
            self._calls |= {(call.rule, name in self.own) for name in call.players if name in (*self.own, *self.others)}
        if self.reached is not None or self.spoiled:
            return
        goal = self.goal
        if goal.never and (goal.never, True) in self._calls:
            self.spoiled = "call"
        elif goal.within is not None and state.total > goal.within:
            self.spoiled = "time"
        elif all(self._holds(state)):
            self.reached = state.total

    def _move(self, name: str, pose: Pose) -> None:
        before = self._poses.get(name, pose)
        self._poses[name] = pose
        self._ways[name] = self._ways.get(name, 0.0) + math.dist((before.x, before.y), (pose.x, pose.y))
        self._turns[name] = self._turns.get(name, 0.0) + wrap(pose.theta - before.theta)

    def _holds(self, state: RefereeState) -> list[bool]:
        """Whether each part of the goal holds now; one of no parts never holds."""
        goal = self.goal
        points, most = state.score.get(self.team, 0), max(
            (points for team, points in state.score.items() if team != self.team), default=0
        )  # fmt: skip
        regions = [zone.region for zone in state.zones if zone.kind == goal.zone]
        found = [
            (goal.call is not None, (goal.call, True) in self._calls),
            (goal.against is not None, (goal.against, False) in self._calls),
            (goal.zone is not None, any(r.contains(p.x, p.y) for r in regions for p in self._poses.values())),
            (goal.way is not None, max(self._ways.values(), default=0.0) >= (goal.way or 0.0)),
            (
                goal.turned is not None,
                max(map(abs, self._turns.values()), default=0.0) >= math.radians(goal.turned or 0.0),
            ),
            (goal.points is not None, points >= (goal.points or 0)),
            (goal.ahead is not None, points - most >= (goal.ahead or 0)),
            (goal.wins, state.winner == self.team),
            (goal.prints, self._printed),
        ]
        wanted = [held for named, held in found if named]
        return wanted or [False]
