"""A small match of RoboFlag for tests: two teams on the field of scale 2, 12 m by 8 m about the origin.

Red has the half of low x, its home in the corner (-6, -4) and its flag at (-4, 1.6). Blue's half is the same, turned by
half a turn about the centre. The tag distance and the reach of flags are 0.6 m, that of homes is 1.2 m, and flag zones
have a radius of 1 m.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import structs

from vrg.bus.messages import Stage
from vrg.coordinator.match import Match
from vrg.coordinator.outcome import Effects
from vrg.coordinator.rulebook import Contestant, Disqualification, Observation, Offer, Verdict
from vrg.games.roboflag import FLAGGED, TAGGED, other
from vrg.games.roboflag.rules import RoboFlag, State
from vrg.games.roboflag.settings import Settings
from vrg.types import Pose, Vector

PIONEER = (0.5, 0.49)
DT = 0.1
MID = 0.0
HOMES = {"red": (-6.0, -4.0), "blue": (6.0, 4.0)}
FLAGS = {"red": (-4.0, 1.6), "blue": (4.0, -1.6)}
AWAY = {"red": (-3.0, -3.0), "blue": (3.0, 3.0)}
"""A place in the own half where nothing happens; those of team mates are 1 m apart."""


def starts(red: int = 4, blue: int = 4) -> dict[str, Pose]:
    """Players red1, red2... and blue1, blue2..., each in its own half, 1 m apart and far from everything."""
    poses = {}
    for team, number in (("red", red), ("blue", blue)):
        sign = -1.0 if team == "red" else 1.0
        for i in range(number):
            poses[f"{team}{i + 1}"] = Pose(sign * 1.5, sign * (3.5 - i), 0.0)
    return poses


def contestants(
    red: int = 4, blue: int = 4, *, size: Vector = PIONEER, moved: Mapping[str, Vector] = {}
) -> list[Contestant]:
    poses = starts(red, blue) | {name: Pose(x, y, 0.0) for name, (x, y) in moved.items()}
    return [
        Contestant(name=name, role=name.rstrip("0123456789"), start=pose, size=size, v_max=0.7)
        for name, pose in poses.items()
    ]


def book(red: int = 4, blue: int = 4, **settings: Any) -> RoboFlag:
    return RoboFlag(Settings(**settings), contestants(red, blue))


def field(rules: RoboFlag, moved: Mapping[str, Vector] = {}, offers: Sequence[Offer] = ()) -> Observation:
    """Everybody at the start, but for those who have moved."""
    poses = {name: c.start for name, c in rules.contestants.items()}
    return Observation(poses | {name: Pose(x, y, 0.0) for name, (x, y) in moved.items()}, offers=offers)


def judge(
    rules: RoboFlag, moved: Mapping[str, Vector] = {}, state: State | None = None, clock: float = 1.0
) -> Verdict[State]:
    """Judge one instant."""
    now = field(rules, moved)
    return rules.judge(state or rules.initial(), now, now, clock)


def carrying(rules: RoboFlag, *carriers: str, state: State | None = None) -> State:
    """The state in which these players carry the flags of their opponents."""
    state = state or rules.initial()
    for name in carriers:
        state = state.with_state([name], FLAGGED).with_carrier(other(rules.teams[name]), name)
    return state


def tagged(rules: RoboFlag, *names: str, state: State | None = None) -> State:
    """The state in which these players are tagged."""
    return (state or rules.initial()).with_state(names, TAGGED)


def out(state: State, *names: str) -> State:
    """The state in which these players are disqualified."""
    return structs.replace(state, disqualified={**state.disqualified, **{n: Disqualification(why="x") for n in names}})


def calls(verdict: Verdict[State] | Effects) -> list[tuple[str, ...]]:
    """The calls of a verdict, each as its rule and the players that it concerns."""
    return [(call.rule, *call.players) for call in verdict.calls]


class Play:
    """A match tick by tick, with its stages and clocks.

    Attributes:
        calls: all calls so far, each as its rule and the players that it concerns.
        stages: all stages that were entered.
    """

    def __init__(self, rules: RoboFlag) -> None:
        self.rules, self.match = rules, Match(rules)
        self.calls: list[tuple[str, ...]] = []
        self.stages: list[Stage] = []
        self.begin()

    @property
    def state(self) -> State:
        state: State = self.match.game
        return state

    def tick(
        self, moved: Mapping[str, Vector] = {}, bids: Sequence[tuple[str, str, float | None]] = (), dt: float = DT
    ) -> Effects:
        outcome = self.match.step(dt, field(self.rules, moved, [Offer(*bid) for bid in bids]), [])
        self.calls += calls(outcome)
        self.stages += outcome.stages
        return outcome

    def ticks(self, seconds: float, moved: Mapping[str, Vector] = {}) -> None:
        for _ in range(round(seconds / DT)):
            self.tick(moved)

    def begin(self) -> None:
        """Let the round begin, with everybody at the start."""
        self.tick()
        assert self.match.stage is Stage.PLAY_ROUND, self.match.waiting

    def capture(self, name: str) -> None:
        """Let a player take the flag and bring it home, in two ticks."""
        team = self.rules.teams[name]
        self.tick({name: FLAGS[other(team)]})
        self.tick({name: HOMES[team]})

    def pause(self) -> None:
        """Wait until the pause after a round is over, and one tick more in which a new round begins."""
        assert self.match.stage is Stage.ROUND_OVER
        while self.match.stage is Stage.ROUND_OVER:
            self.tick(dt=1.0)
        if not self.match.over:
            self.begin()

    @property
    def rulings(self) -> list[str]:
        return [rule for rule, *_ in self.calls]
