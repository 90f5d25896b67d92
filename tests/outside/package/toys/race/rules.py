"""The settings and the rules of the race."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from toys.race import GAME, GREEN, RED
from vrg.bus.messages import Zone
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict
from vrg.errors import ConfigError, Problem
from vrg.regions import Circle
from vrg.tables import Table
from vrg.types import Pose, Vector

TEAMS = (RED, GREEN)


class Settings(Table):
    """The [rules] table: where the round finish is, m, and how long a race may take, s."""

    x: float
    y: float
    radius: float = 1.0
    time: float = 120.0


class Race(RuleBook[GameState]):
    name = GAME.name
    round_word = GAME.round_word
    state_type = GameState
    lineup_limit = 30.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        self.time = settings.time
        self.finish = Circle(settings.x, settings.y, settings.radius)
        super().__init__(contestants)
        inside = [c.name for c in contestants if self.finish.contains(c.start.x, c.start.y)]
        if inside:
            raise ConfigError([Problem("starts in the finish", ("players", name)) for name in inside])

    def initial(self) -> GameState:
        return GameState(points=dict.fromkeys(TEAMS, 0))

    def judge(self, state: GameState, before: Observation, now: Observation, clock: float) -> Verdict[GameState]:
        racing = sorted(now.poses.keys() & self.contestants.keys() - state.disqualified.keys())
        home = [n for n in racing if self.finish.inside(_place(before.poses, n, now), _place(now.poses, n, now))]
        if not home:
            return Verdict(state, round_over=clock >= self.time)
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

    def time_limit(self, state: GameState) -> float:
        return self.time

    def zones(self, state: GameState) -> list[Zone]:
        return [Zone(name="finish", kind="finish", region=self.finish)]


def _place(poses: Mapping[str, Pose], name: str, now: Observation) -> Vector:
    """Where a robot is in a field, and where it is not in it, where it is now."""
    pose = poses.get(name, now.poses[name])
    return pose.x, pose.y
