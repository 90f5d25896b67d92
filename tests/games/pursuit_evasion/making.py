"""A small match of pursuit-evasion for tests: a square area of 10 m, and fields in it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import structs

from vrg.bus.messages import Sighting
from vrg.coordinator.auctions import auctioned
from vrg.coordinator.rulebook import Contestant, Disqualification, Observation, Offer, Verdict
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.games.pursuit_evasion.settings import Settings
from vrg.games.pursuit_evasion.state import State
from vrg.hal.sensors.spec import Sweep
from vrg.types import Pose, Vector

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
SETTINGS = Settings(area=SQUARE)
PIONEER, ATRV_JR = (0.5, 0.49), (0.78, 0.64)
STARTS = {
    "p0": Pose(1.0, 9.0, 0.0),
    "p1": Pose(9.0, 9.0, 0.0),
    "p2": Pose(9.0, 1.0, 0.0),
    "i0": Pose(-2.0, 5.0, 0.0),
    "i1": Pose(-2.0, 3.0, 0.0),
    "i2": Pose(-2.0, 7.0, 0.0),
}
DT = 0.1
LASER = Sweep(Pose(0.0, 0.0, 0.0), fov=math.tau, range_max=100.0)


class Patient(PursuitEvasion):
    """A rule book that lets intruders stand, for tests of everything else."""

    def least_way(self, name: str, seconds: float) -> float:
        return -math.inf


def contestants(
    pursuers: int = 3, intruders: int = 2, starts: Mapping[str, Pose] = {}, speeds: Mapping[str, float] = {}
) -> list[Contestant]:
    names = [f"p{i}" for i in range(pursuers)] + [f"i{i}" for i in range(intruders)]
    return [
        Contestant(
            name=name,
            role="pursuer" if name[0] == "p" else "intruder",
            start={**STARTS, **starts}[name],
            size=PIONEER if name[0] == "p" else ATRV_JR,
            v_max=speeds.get(name, 0.7 if name[0] == "p" else 1.0),
            sweeps=(LASER,) if name[0] == "p" else (),
        )
        for name in names
    ]


def book(settings: Settings = SETTINGS, *, seed: int = 0, **others: Any) -> PursuitEvasion:
    return Patient(settings, contestants(**others), seed)


def field(
    rules: PursuitEvasion,
    moved: Mapping[str, Vector] = {},
    *,
    time: float = 10.0,
    seen: Sequence[tuple[str, Sighting]] = (),
    offers: Sequence[Offer] = (),
    moving: Sequence[str] = (),
) -> Observation:
    """Everybody at the start, but for those who have moved."""
    poses = {c.name: c.start for c in rules.contestants.values()}
    poses |= {name: Pose(x, y, 0.0) for name, (x, y) in moved.items()}
    return Observation(poses, frozenset(moving), time=time, sightings=seen, offers=offers)


def crossing(rules: PursuitEvasion, *names: str, entered: bool = True, **others: Any) -> State:
    """The state in which intruders are in play, by default inside the area."""
    state = rules.initial().with_state(names, "crossing")
    return structs.replace(state, entered=sorted(names) if entered else [], **others)


def out(state: State, *names: str) -> State:
    """The state in which players are disqualified."""
    return structs.replace(state, disqualified={**state.disqualified, **{n: Disqualification(why="x") for n in names}})


def sighting(x: float, y: float, time: float) -> Sighting:
    return Sighting(x=x, y=y, time=time, xx=0.01, xy=0.0, yy=0.01)


def move(
    rules: PursuitEvasion,
    state: State,
    start: Mapping[str, Vector],
    end: Mapping[str, Vector],
    *,
    time: float = 10.0,
    clock: float = 1.0,
    seen: Sequence[tuple[str, Sighting]] = (),
) -> Verdict[State]:
    """Judge one tick in which players move from one place to another."""
    return rules.judge(state, field(rules, start, time=time - DT), field(rules, end, time=time, seen=seen), clock)


class Play:
    """A match tick by tick: takes bids in and judges, as `vrg.coordinator.match.Match` does in play."""

    def __init__(self, rules: PursuitEvasion, state: State | None = None, clock: float = 0.0) -> None:
        self.rules, self.state, self.clock = rules, state or rules.initial(), clock
        self.before = field(rules, time=clock)
        self.calls: list[tuple[str, str]] = []
        self.over = False

    @property
    def rulings(self) -> list[str]:
        return [rule for rule, _ in self.calls]

    def tick(
        self,
        moved: Mapping[str, Vector] = {},
        *,
        seen: Sequence[tuple[str, Sighting]] = (),
        bids: Sequence[tuple[str, str, float | None]] = (),
        moving: Sequence[str] = (),
    ) -> None:
        self.clock = round(self.clock + DT, 6)
        now = field(self.rules, moved, time=self.clock, seen=seen, moving=moving)
        self.state, _ = auctioned(self.state, [Offer(*bid) for bid in bids], self.clock)
        verdict = self.rules.judge(self.state, self.before, now, self.clock)
        self.state, self.before, self.over = verdict.state, now, verdict.round_over
        self.calls += [(call.rule, call.text) for call in verdict.calls]
