"""The settings and the rules of the race."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import structs

from toys.race import GAME, GREEN, RED
from vrg.bus.messages import OfficialAction, PlayerStatus, Stage, Zone
from vrg.coordinator.rulebook import Call, Contestant, Field, GameState, Verdict
from vrg.errors import ConfigError, Problem
from vrg.geometry import circumradius
from vrg.regions import Circle
from vrg.tables import Table
from vrg.types import Pose

REACH = 0.4
TEAMS = (RED, GREEN)


class Settings(Table):
    """The [rules] table: where the round finish is."""

    x: float
    y: float
    radius: float = 1.0


class State(GameState, frozen=True, kw_only=True):
    score: dict[str, int]


class Race:
    name = GAME.name
    round_word = GAME.round_word
    state_type = State
    rounds = 1
    lineup_limit = 30.0

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int) -> None:
        self.finish = Circle(settings.x, settings.y, settings.radius)
        self.contestants = {c.name: c for c in contestants}
        inside = [c.name for c in contestants if self.finish.contains(c.start.x, c.start.y)]
        if inside:
            raise ConfigError([Problem("starts in the finish", ("players", name)) for name in inside])

    def initial(self) -> State:
        return State(score=dict.fromkeys(TEAMS, 0))

    def obstacles_to_start(self, state: State, now: Field) -> dict[str, str]:
        return {
            name: "is not on its mark"
            for name, contestant in self.contestants.items()
            if not _is_at(now.poses.get(name), contestant.start) or name in now.moving
        }

    def marks(self, state: State) -> dict[str, Pose]:
        return {c.name: c.start for c in self.contestants.values()}

    def judge(self, state: State, before: Field, now: Field, clock: float) -> Verdict[State]:
        home = [n for n in sorted(self.contestants) if n in now.poses and self.finish.contains(*_place(now.poses, n))]
        if not home:
            return Verdict(state)
        score = dict(state.score)
        for team in {self.contestants[name].role for name in home}:
            score[team] += 1
        call = Call(
            rule="finish",
            text=f"{' and '.join(home)} at the finish after {clock:.1f} s",
            players=tuple(home),
            poses=tuple(now.poses[name] for name in home),
        )
        return Verdict(structs.replace(state, score=score), [call], round_over=True)

    def obstacles_to_resume(self, state: State, now: Field) -> list[str]:
        return []

    def next_round(self, state: State, now: Field) -> Verdict[State]:
        best = [team for team in TEAMS if state.score[team] == max(state.score.values())]
        return Verdict(state, winner=best[0] if len(best) == 1 else "draw")

    def statuses(self, state: State, stage: Stage, now: Field) -> list[PlayerStatus]:
        lining_up = stage is Stage.INITIALIZE
        return [
            PlayerStatus(
                name=name,
                team=contestant.role,
                role=contestant.role,
                state="active",
                may_move=stage is Stage.PLAY_ROUND or (lining_up and not _is_at(now.poses.get(name), contestant.start)),
                radius=circumradius(contestant.size),
                pose=now.poses.get(name),
                mark=contestant.start if lining_up else None,
            )
            for name, contestant in self.contestants.items()
        ]

    def zones(self, state: State) -> list[Zone]:
        return [Zone(name="finish", kind="finish", region=self.finish)]

    def score(self, state: State) -> dict[str, int]:
        return state.score

    def speed_limits(self) -> dict[str, float]:
        return {}

    def overrule(self, state: State, action: OfficialAction, subject: str, value: str) -> State:
        if action is not OfficialAction.SET_SCORE or subject not in TEAMS or not value.isdigit():
            raise ConfigError([f"{action}: expected set-score with a team and a number, got {subject!r} {value!r}"])
        return structs.replace(state, score={**state.score, subject: int(value)})


def _place(poses: Mapping[str, Pose], name: str) -> Any:
    return poses[name].x, poses[name].y


def _is_at(pose: Pose | None, mark: Pose) -> bool:
    return pose is not None and math.hypot(pose.x - mark.x, pose.y - mark.y) <= REACH
