"""The settings and the rules of the race."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from toys.race import GAME, GREEN, RED
from vrg.bus.messages import Zone
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict
from vrg.errors import ConfigError, Problem
from vrg.regions import Circle
from vrg.tables import Table
from vrg.types import Pose

TEAMS = (RED, GREEN)


class Settings(Table):
    """The [rules] table: where the round finish is."""

    x: float
    y: float
    radius: float = 1.0


class Race(RuleBook[GameState]):
    name = GAME.name
    round_word = GAME.round_word
    state_type = GameState
    lineup_limit = 30.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        self.finish = Circle(settings.x, settings.y, settings.radius)
        super().__init__(contestants)
        inside = [c.name for c in contestants if self.finish.contains(c.start.x, c.start.y)]
        if inside:
            raise ConfigError([Problem("starts in the finish", ("players", name)) for name in inside])

    def initial(self) -> GameState:
        return GameState(points=dict.fromkeys(TEAMS, 0))

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        home = [n for n in sorted(self.contestants) if n in now.poses and self.finish.contains(*_place(now.poses, n))]
        if not home:
            return Verdict(state)
        for team in {self.contestants[name].role for name in home}:
            state = state.with_points(team, state.points[team] + 1)
        call = Call(
            rule="finish",
            text=f"{' and '.join(home)} at the finish after {clock:.1f} s",
            players=tuple(home),
            poses=tuple(now.poses[name] for name in home),
        )
        return Verdict(state, [call], round_over=True)

    def next_round(self, state: GameState, now: Observation) -> Verdict[GameState]:
        return replace(super().next_round(state, now), why="one lap: first home, first served")

    def zones(self, state: GameState) -> list[Zone]:
        return [Zone(name="finish", kind="finish", region=self.finish)]


def _place(poses: Mapping[str, Pose], name: str) -> Any:
    return poses[name].x, poses[name].y
