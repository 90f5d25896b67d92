"""The rules of Sharks and Minnows (thesis 4.3, Algorithm 4.2).

Minnows cross a rectangle from one end to the other, and sharks tag them. A tagged minnow, and any player out of bounds,
stands still until the pass is over and is a shark in the next.
"""

import math
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
from msgspec import structs

from vrg.bus.messages import Zone
from vrg.coordinator.look import Look
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict, called
from vrg.errors import ConfigError
from vrg.games.sharks_and_minnows import ACTIVE, GAME, INACTIVE, MINNOW, MINNOWS, SHARK, SHARKS, judging
from vrg.games.sharks_and_minnows.lineup import LargestBody, line_up
from vrg.games.sharks_and_minnows.settings import Settings, opposite, passes, problems_of
from vrg.regions import Region
from vrg.types import Pose

PASS_TIME_FACTOR = 3.0
"""The default time limit of a pass, in terms of what the slowest player may need for the length of the field."""


ENDS = ("low", "high")
"""The ends of the field by their numbers."""


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. A round is a pass.

    The sharks have a point for each minnow taken out, and the minnows one for each safe crossing.

    Args:
        roles: the role of each player.
        goal: the end that the minnows cross to in this pass, `low` or `high`.
        marks: the pose where each player lines up.
    """

    roles: dict[str, str]
    goal: str
    marks: dict[str, Pose]

    def active(self, role: str) -> list[str]:
        """The names of the active players of a role."""
        return [n for n, r in self.roles.items() if r == role and self.states[n] == ACTIVE]


class SharksAndMinnows(RuleBook[State]):
    """The rule book of Sharks and Minnows.

    Args:
        settings: the [rules] table of the match file.
        contestants: the players.
        seed: the seed of the match, by which top speeds are drawn.

    Raises:
        ConfigError: the match cannot be played; see `problems_of`. The error lists all reasons.
    """

    name = GAME.name
    round_word = GAME.round_word
    state_type = State

    def __init__(self, settings: Settings, contestants: Sequence[Contestant], seed: int = 0) -> None:
        super().__init__(contestants)
        self._seed = seed
        self.settings = settings
        self._field = settings.field
        self._ends = {end: settings.end_zone(end) for end in ENDS}
        self._extent = LargestBody.of(contestants)
        if problems := problems_of(settings, contestants, self._extent):
            raise ConfigError(problems)
        self.rounds = settings.passes or passes(contestants)
        self.lineup_limit = settings.patience
        slowest = settings.slowest * min(c.v_max for c in contestants)
        limit = settings.pass_limit
        self.pass_limit = PASS_TIME_FACTOR * settings.length / slowest if limit is None else limit
        self._names = sorted(self.contestants)
        self._sizes = [self.contestants[name].size for name in self._names]
        self._setting = SimpleNamespace(
            bounds=self._field.bounds,
            zones=[zone.bounds for zone in self._ends.values()],
            tag_distance=settings.tag_distance,
            pass_limit=self.pass_limit,
            order=range(len(self._names)),
        )

    def initial(self) -> State:
        """The state in which every player is active, with the role and the place of the match file."""
        return State(
            roles={c.name: c.role for c in self.contestants.values()},
            states=dict.fromkeys(self.contestants, ACTIVE),
            points={SHARKS: 0, MINNOWS: 0},
            goal=self.settings.first_goal,
            marks={c.name: c.start for c in self.contestants.values()},
        )

    def marks(self, state: State) -> dict[str, Pose]:
        """The mark of each player in this pass."""
        return state.marks

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        """Judge tags and exits over the whole way between two instants, then the time limit and the end of the pass."""
        # A disqualified player is out, like one that is tagged, but no team scores by it.
        state = state.with_state(state.disqualified, INACTIVE)
        names = self._names
        look = Look(names, before, now, len(names) + 1)
        standing = SimpleNamespace(
            roles=[judging.SHARK if state.roles[name] == SHARK else judging.MINNOW for name in names],
            active=[state.states[name] == ACTIVE for name in names],
            points=[state.points[team] for team in (MINNOWS, SHARKS)],
            seen=[here + both for here, both in zip(look.here, look.seen, strict=True)],
            goal=ENDS.index(state.goal),
            outs=[judging.STAYS] * len(names),
            exits=[math.inf] * len(names),
            instants=[math.inf] * len(names),
            hunters=[0] * len(names),
            boxes=[(0.0, 0.0, 0.0, 0.0)] * len(names),
        )
        over = judging.judge(self._setting, standing, look, look.before, look.now, self._sizes, clock)
        minnows, sharks = standing.points
        state = state.with_points(MINNOWS, minnows).with_points(SHARKS, sharks)
        state = state.with_state([name for name, on in zip(names, standing.active, strict=True) if not on], INACTIVE)
        return Verdict(state, [self._call(state, *noted) for noted in look.noted()], round_over=over)

    def _call(self, state: State, rule: int, players: tuple[str, ...], poses: tuple[Pose, ...]) -> Call:
        match rule:
            case judging.TAGGED:
                what = f"{players[0]} is tagged by {' and '.join(players[1:])}, and out of this pass"
            case judging.OUT_OF_BOUNDS:
                where = f"({poses[0].x:.2f}, {poses[0].y:.2f})"
                what = f"{players[0]} is out of bounds at {where}, and out of this pass"
            case judging.LATE:
                what = f"{players[0]} is not in the safe zone after {self.pass_limit:.0f} s, and out of this pass"
            case _:
                left = f"{len(players)} minnow{'' if len(players) == 1 else 's'} left"
                what = f"pass {state.round} of {self.rounds} is over, {left}"
        return Call(rule=judging.RULES[rule], text=what, players=players, poses=poses)

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        """End the game, or let inactive players become sharks and the teams swap ends."""
        state = state.with_state(state.disqualified, INACTIVE)  # also those that were disqualified since play
        won = judging.winner(len(state.active(MINNOW)), state.round, self.rounds)
        if won != judging.NO_ROLE:
            winner = (MINNOWS, SHARKS)[won]
            return Verdict(state, winner=winner, why=GAME.won_words[winner])
        recruits = [n for n, s in state.states.items() if s == INACTIVE]
        roles = {**state.roles, **dict.fromkeys(recruits, SHARK)}
        goal = opposite(state.goal)
        field, ends = self._field, {SHARK: goal, MINNOW: state.goal}
        marks: dict[str, Pose] = {}
        # The referee does not drive them away: people may carry them, but need not.
        stay = [now.poses[n] for n in state.disqualified if n in now.physical and n in now.poses]
        for role, end in ends.items():
            marks |= line_up(
                {n: now.poses.get(n, state.marks[n]) for n, r in roles.items() if r == role},
                self._ends[end],
                field,
                self._extent,
                obstacles=[(pose.x, pose.y) for pose in stay],
            )
        return Verdict(
            structs.replace(
                state,
                roles=roles,
                states=dict.fromkeys(state.states, ACTIVE),
                round=state.round + 1,
                goal=goal,
                marks={n: marks[n] for n in state.marks},
            ),
            [
                called("new_shark", f"{n} becomes a shark", {n: now.poses[n]})
                for n in recruits
                if n in now.poses and state.roles[n] == MINNOW and n not in state.disqualified
            ],
        )

    def safe_zone(self, state: State) -> Region:
        """The end zone in which minnows are safe in this pass."""
        return self._ends[state.goal]

    def team_of(self, name: str) -> str:
        """The team of a player, which a minnow that becomes a shark does not leave."""
        return SHARKS if self.contestants[name].role == SHARK else MINNOWS

    def role_of(self, state: State, name: str) -> str:
        """The role of a player in this pass."""
        return state.roles[name]

    def may_play(self, state: State, name: str) -> bool:
        """True if a player is active. Everybody knows all positions and roles, but not the top speeds."""
        return state.states[name] == ACTIVE

    def zones(self, state: State) -> list[Zone]:
        """The field, the end zone where minnows are safe, and the end zone where they start."""
        start = self._ends[opposite(state.goal)]
        named: dict[str, Region] = {"field": self._field, "safe": self._ends[state.goal], "start": start}
        return [Zone(name=name, kind=name, region=region) for name, region in named.items()]

    def time_limit(self, state: State) -> float | None:
        """The time of play in s at which minnows outside the end zone become inactive; None without a limit."""
        return self.pass_limit or None

    def speed_limits(self) -> dict[str, float]:
        """The top speeds, drawn by the seed and the player's name. The order of the players does not matter."""
        limits = {}
        for name in sorted(self.contestants):
            rng = np.random.default_rng([self._seed, *name.encode()])
            limits[name] = self.contestants[name].v_max * float(rng.uniform(self.settings.slowest, 1.0))
        return limits

    def roles_of(self, name: str) -> Sequence[str]:
        """The roles that an official may give a player."""
        return SHARK, MINNOW

    def states_of(self, name: str) -> Sequence[str]:
        """The states into which an official may put a player."""
        return ACTIVE, INACTIVE

    def with_role(self, state: State, name: str, role: str) -> State:
        """The state after an official has given a player a role, and with another one a mark at that role's end."""
        if role == state.roles[name]:
            return state
        here = state.marks[name]
        others = [(mark.x, mark.y) for other, mark in state.marks.items() if other != name]
        end = state.goal if role == SHARK else opposite(state.goal)
        mark = line_up({name: here}, self._ends[end], self._field, self._extent, obstacles=others)
        return structs.replace(state, roles={**state.roles, name: role}, marks={**state.marks, **mark})
