"""A small game, Harbour, and rule books of it in which one thing each is wrong.

Two gold and two blue boats start in the west of a basin. A boat that comes into the harbour in the east has a point for
its team, and the first one of the round two. A boat that leaves the basin has sunk. After 20 s a round is over.
"""

import random
from collections.abc import Mapping, Sequence

from msgspec import structs

from vrg.bus.messages import Zone
from vrg.coordinator.rulebook import Call, Contestant, GameState, Observation, RuleBook, Verdict, called
from vrg.geometry import interpolate
from vrg.regions import Circle, Rectangle
from vrg.types import Pose

GOLD, BLUE = "gold", "blue"
HOME, SUNK = "home", "sunk"
TIME = 20.0
BASIN, HARBOUR = Rectangle(-6.0, -4.0, 6.0, 4.0), Circle(4.0, 0.0, 1.0)
BOATS = [
    Contestant(name=f"{team}{i}", role=team, start=Pose(-4.0, y, 0.0), size=(0.5, 0.49), v_max=0.7)
    for team, side in ((GOLD, 1.0), (BLUE, -1.0))
    for i, y in ((1, side), (2, 2.0 * side))
]
READY = Observation({boat.name: boat.start for boat in BOATS})


class State(GameState, frozen=True, kw_only=True):
    """The state. `landed` has the boats that came first in their round, with the number of the round."""

    landed: tuple[tuple[str, int], ...] = ()


class Harbour(RuleBook[State]):
    """The rule book, in which nothing is wrong."""

    name = "harbour"
    state_type = State
    rounds = 2

    def __init__(self) -> None:
        super().__init__(BOATS)

    def initial(self) -> State:
        return State(points={GOLD: 0, BLUE: 0})

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        calls, arrivals = list[Call](), dict[str, float]()
        for name in self.afloat(state, now):
            start, end = before.poses.get(name, now.poses[name]), now.poses[name]
            at = self.arrival(start, end)
            sunk = BASIN.exit_fraction((start.x, start.y), (end.x, end.y))
            if at is not None and (sunk is None or at <= sunk):
                arrivals[name] = at
            elif sunk is not None:
                state = self.sink(state, name)
                calls.append(called("sunk", f"{name} has sunk", {name: interpolate(start, end, sunk)}))
        if arrivals:
            state = self.landing(state, arrivals)
            there = {name: now.poses[name] for name in sorted(arrivals)}
            calls.append(called("home", f"{' and '.join(there)} at home", there))
        return Verdict(state, calls, round_over=clock >= TIME or not self.afloat(state, None))

    def afloat(self, state: State, now: Observation | None) -> list[str]:
        """The boats that are under way, of those that are seen."""
        names = [name for name in self.contestants if now is None or name in now.poses]
        return [name for name in names if name not in state.states and name not in state.disqualified]

    def arrival(self, start: Pose, end: Pose) -> float | None:
        """The fraction of its way at which a boat comes into the harbour."""
        stretch = HARBOUR.inside((start.x, start.y), (end.x, end.y))
        return None if stretch is None else stretch[0]

    def sink(self, state: State, name: str) -> State:
        return state.with_state([name], SUNK)

    def landing(self, state: State, arrivals: Mapping[str, float]) -> State:
        first = self.firsts(arrivals) if HOME not in state.states.values() else ()
        for name in arrivals:
            state = self.land(state, name, 2 if name in first else 1)
        return structs.replace(state, landed=(*state.landed, *((name, state.round) for name in sorted(first))))

    def firsts(self, arrivals: Mapping[str, float]) -> Sequence[str]:
        """Those that come first; of two that come at once both do."""
        return [name for name, at in arrivals.items() if at == min(arrivals.values())]

    def land(self, state: State, name: str, points: int) -> State:
        team = self.team_of(name)
        return state.with_state([name], HOME).with_points(team, state.points[team] + points)

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        verdict = super().next_round(state, now)
        return Verdict(structs.replace(verdict.state, states={}), winner=verdict.winner)

    def time_limit(self, state: State) -> float | None:
        return TIME

    def states_of(self, name: str) -> Sequence[str]:
        return (HOME, SUNK)

    def zones(self, state: State) -> list[Zone]:
        return [Zone(name="basin", kind="field", region=BASIN), Zone(name="harbour", kind="safe", region=HARBOUR)]


class NeverEnds(Harbour):
    """Nobody judges the time."""

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        return super().judge(state, before, now, 0.0)

    def time_limit(self, state: State) -> float | None:
        return None


class Late(Harbour):
    """A round goes on after its time limit."""

    def time_limit(self, state: State) -> float | None:
        return TIME - 5.0


class Random(Harbour):
    """Of two that come at once one is drawn."""

    def firsts(self, arrivals: Mapping[str, float]) -> Sequence[str]:
        return [random.choice(list(super().firsts(arrivals)))]


class Ordered(Harbour):
    """Of two that come at once it is the one that stands first in the list of poses."""

    def judge(self, state: State, before: Observation, now: Observation, clock: float) -> Verdict[State]:
        self.contestants = {name: self.contestants[name] for name in [*now.poses, *self.contestants]}
        return super().judge(state, before, now, clock)

    def firsts(self, arrivals: Mapping[str, float]) -> Sequence[str]:
        return super().firsts(arrivals)[:1]


class ByLooks(Harbour):
    """A boat that crosses the harbour between two looks is not seen there."""

    def arrival(self, start: Pose, end: Pose) -> float | None:
        return 1.0 if HARBOUR.contains(end.x, end.y) else None


class ScoresForAll(Harbour):
    """Boats that are disqualified score."""

    def afloat(self, state: State, now: Observation | None) -> list[str]:
        return super().afloat(structs.replace(state, disqualified={}), now)


class Forgetful(Harbour):
    """Who is disqualified plays again in the second round."""

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        verdict = super().next_round(state, now)
        return Verdict(structs.replace(verdict.state, disqualified={}), winner=verdict.winner)


class Negative(Harbour):
    """A boat that sinks costs a point."""

    def sink(self, state: State, name: str) -> State:
        team = self.team_of(name)
        return super().sink(state, name).with_points(team, state.points[team] - 1)


class UnknownWinner(Harbour):
    """The winner is no team."""

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        verdict = super().next_round(state, now)
        return Verdict(verdict.state, winner=None if verdict.winner is None else f"{verdict.winner} boats")


class Raises(Harbour):
    """What follows a round cannot be judged if nobody came home."""

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        _best = max(points for points in state.points.values() if points > 0)
        return super().next_round(state, now)


class Remembers(Harbour):
    """It has a memory of its own."""

    def __init__(self) -> None:
        super().__init__()
        self.home = set[str]()

    def land(self, state: State, name: str, points: int) -> State:
        again = name in self.home
        self.home.add(name)
        return super().land(state, name, 1 if again else points)


class NeedsAll(Harbour):
    """It needs the pose of every boat."""

    def afloat(self, state: State, now: Observation | None) -> list[str]:
        return [name for name in super().afloat(state, None) if now is None or now.poses[name] is not None]


class NotInTheJournal(Harbour):
    """Its state has a list where it says that there is a tuple."""

    def landing(self, state: State, arrivals: Mapping[str, float]) -> State:
        state = super().landing(state, arrivals)
        return structs.replace(state, landed=list(state.landed))


class Mutates(Harbour):
    """It changes the points in the state that it was given."""

    def land(self, state: State, name: str, points: int) -> State:
        state.points[self.team_of(name)] += points  # type: ignore[index]
        return state.with_state([name], HOME)


class CountsItself(Harbour):
    """The points follow from the state, and what an official sets is lost."""

    def score(self, state: State) -> dict[str, int]:
        home = [self.team_of(name) for name, own in state.states.items() if own == HOME]
        return {team: home.count(team) for team in (GOLD, BLUE)}


class NoWayBack(Harbour):
    """Before the second round boats line up in the north, and it begins where they were in the first."""

    def marks(self, state: State) -> Mapping[str, Pose]:
        starts = super().marks(state)
        return starts if state.round == 1 else {n: Pose(s.x, s.y + 9.0, 0.0) for n, s in starts.items()}

    def obstacles_to_start(self, state: State, now: Observation) -> dict[str, str]:
        return super().obstacles_to_start(structs.replace(state, round=1), now)


class SameRound(Harbour):
    """The first round is played again and again."""

    def next_round(self, state: State, now: Observation) -> Verdict[State]:
        return Verdict(structs.replace(state, states={}))


class KeepsState(Harbour):
    """What an official puts a boat into is announced, and forgotten."""

    def put_into(self, state: State, name: str, value: str) -> State:
        return state


FAULTY: Mapping[type[Harbour], str] = {
    NeverEnds: "the match does not end",
    Late: "`time_limit` is 15 s, and play goes on",
    Random: "judged a second time",
    Ordered: "with the players in another order",
    ByLooks: "nothing is called; with 30 looks",
    ScoresForAll: "is disqualified, and the score depends on where it is",
    Forgetful: "`next_round` forgets who is disqualified",
    Negative: "points are never below 0",
    UnknownWinner: "expected one of gold, blue, draw, nobody",
    Raises: "ValueError: max.* in `next_round`",
    Remembers: "has another result",
    NeedsAll: "KeyError: .* in ",
    NotInTheJournal: "when the journal is read",
    Mutates: "the state that was handed in is changed",
    CountsItself: "`set-score gold 9` is announced, and at once the score is",
    NoWayBack: "everybody stands still on its mark, and round does not begin",
    SameRound: "`next_round` returns the same round",
    KeepsState: "is announced, but its status says 'active'",
}
"""The rule books in which something is wrong, and what the suite says of each."""
