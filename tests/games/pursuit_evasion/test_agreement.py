"""Random games in which the rule book and a slow referee must agree on every call, whatever officials decide.

The slow referee knows nothing of the rule book: it looks at many instants of each tick, one after the other. Where it
cannot tell within EPSILON what happened, the rule book is believed. Nobody tells of sightings here, so nobody is sent.
"""

import math
import random
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import pytest

from tests.games.pursuit_evasion.making import SQUARE, STARTS, contestants
from tests.games.sharks_and_minnows.test_agreement import corners, gap
from vrg.bus.messages import FAILED, Official, OfficialAction, Stage
from vrg.coordinator.decisions import decide
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Observation
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.games.pursuit_evasion.settings import Settings
from vrg.types import Pose, Vector

TICK, LOOKS = 0.2, 40
SPEED, TIME, REACH = 0.7, 24.0, 1.0
"""The top speed of all, m/s, the time of the game, s, and how near a pursuer captures, m."""
ASIDE, TOUCH = 0.5, 0.05
"""How far from its course an intruder stays, m, and how near two robots touch, m."""
GETTING_UP, STRETCH, LEAST = 2.0, 5.0, 0.6
"""The times in s in which an intruder gets up its speed, and over which that is judged; the share that it keeps."""
JUMP = 0.5
"""How far beyond what it can drive a player is, m, if it was put there."""
EPSILON = 0.01
GAMES, ALL_GAMES = 50, 1000
Calls = list[tuple[str, tuple[str, ...]]]


@dataclass
class Course:
    """The line of an intruder, since when it may drive, s, and when and where its speed was judged last."""

    line: Pose
    since: float
    mark: tuple[float, Pose] | None = None


@dataclass
class Ledger:
    """What a slow referee remembers.

    Args:
        states: of the intruders. launches: when each starts, s of play. sizes: of all robots, m.
    """

    states: dict[str, str]
    launches: Mapping[str, float]
    sizes: Mapping[str, Vector]
    points: dict[str, int] = field(default_factory=lambda: {"pursuers": 0, "intruders": 0})
    entered: set[str] = field(default_factory=set)
    courses: dict[str, Course] = field(default_factory=dict)
    out: dict[str, bool] = field(default_factory=dict)
    """The disqualified players; True if an official has decided it."""
    back: set[str] = field(default_factory=set)
    """Those of them that would play again from another round."""

    def decide(self, official: Official, *, lining_up: bool) -> None:
        """Take in a decision; one that is impossible changes nothing."""
        name, value = official.subject or "", official.value or ""
        match official.action:
            case OfficialAction.SET_SCORE:
                self.points[name] = int(value)
            case OfficialAction.SET_STATE if name in self.states:
                self.states[name] = value
                if value in ("waiting", "crossing"):
                    self.entered.discard(name)
                    self.courses.pop(name, None)
            case OfficialAction.DISQUALIFY if value != FAILED or not self.out.get(name):
                self.out[name] = value != FAILED
                self.back.discard(name)
            case OfficialAction.REINSTATE if name in self.out and lining_up:
                del self.out[name]
                self.back.discard(name)
            case OfficialAction.REINSTATE if name in self.out:
                self.back.add(name)

    def crossing(self) -> list[str]:
        """The intruders in play."""
        return sorted(n for n, state in self.states.items() if state == "crossing" and n not in self.out)

    def rule(
        self, before: Mapping[str, Pose] | None, now: Mapping[str, Pose], clock: float, made: Calls
    ) -> tuple[Calls, bool]:
        """The calls of a tick of play, and whether they are sure.

        Args:
            before: where everybody was at the look before; None if play was halted until now. clock: the time of play.
            made: those of the rule book, which is believed where nothing is sure.
        """
        calls: Calls = []
        for name, state in self.states.items():
            if state == "waiting" and self.launches[name] <= clock and name not in self.out:
                self.states[name] = "crossing"
                calls.append(("launch", (name,)))
        ways = {n: (now[n] if before is None or put(before[n], now[n]) else before[n], now[n]) for n in now}
        self._set_courses(before, now, clock)
        sure = True
        for name in self.crossing():
            fates = [self._fate(name, ways, a * EPSILON, b * EPSILON) for a in (-1, 0, 1) for b in (-1, 0, 1)]
            fate = fates[4]  # without an offset
            if any(other != fate for other in fates):
                fate, sure = [c for c in made if c[1][:1] == (name,) and c[0] in ENDS], False
            self._end(name, fate)
            calls += fate
        for name in self.crossing():
            gaps = [(self._gap(name, other, now), other) for other in now if other != name]
            if min(gaps)[0] <= TOUCH:
                self.states[name] = "out"
                calls.append(("collision", (name, min(gaps)[1])))
        for name in self.crossing():
            if rule := self._strayed(self.courses[name], now[name], clock):
                self._captured(name)
                calls.append((rule, (name,)))
        left = [n for n, state in self.states.items() if state in ("waiting", "crossing") and n not in self.out]
        if not left or clock >= TIME - 1e-9:
            calls.append(("time_up" if left else "all_done", ()))
        return calls, sure

    def _set_courses(self, before: Mapping[str, Pose] | None, now: Mapping[str, Pose], clock: float) -> None:
        """A course begins where an intruder comes into play, or is put; after a halt it gets up its speed again."""
        self.courses = {name: course for name, course in self.courses.items() if name in self.crossing()}
        for name in self.crossing():
            course = self.courses.get(name)
            if course is None or (before is not None and put(before[name], now[name])):
                self.courses[name] = Course(now[name], clock)
            elif before is None:
                carried = abs(aside(course.line, now[name])) > ASIDE
                self.courses[name] = Course(now[name] if carried else course.line, clock)

    def _fate(self, name: str, ways: Mapping[str, tuple[Pose, Pose]], nearer: float, wider: float) -> Calls:
        """What ends a crossing in this tick, with a reach of so much more, and an area so much wider, m."""
        looks = [look / LOOKS for look in range(LOOKS + 1)]
        way, heading = ways[name], self.courses[name].line.theta
        inside = [t for t in looks if within(at(way, t), wider)]
        calls: Calls = [("enter", (name,))] if inside and name not in self.entered else []
        entered, leaves = bool(inside) or name in self.entered, math.inf
        end = at(way, 1.0)
        ahead = [(end[0] + s / 4 * math.cos(heading), end[1] + s / 4 * math.sin(heading)) for s in range(200)]
        if not any(within(place, wider) for place in ahead):
            leaves = last(lambda t: within(at(way, t), wider), inside[-1]) if inside else 0.0 if entered else 1.0
        captures = []
        for pursuer in (n for n in sorted(ways) if n not in self.states and n not in self.out):
            chase = ways[pursuer]

            def near(t: float, chase: tuple[Pose, Pose] = chase) -> bool:
                return math.dist(at(way, t), at(chase, t)) < REACH + nearer

            if (hit := next((t for t in looks if near(t)), None)) is not None:
                captures.append((hit - last(lambda s: near(hit - s), 0.0) if hit else 0.0, pursuer))
        first = min(captures, default=(math.inf, ""))
        if first[0] < math.inf and first[0] <= leaves:
            return [*calls, ("capture", (name, first[1]))]
        if leaves < math.inf:
            calls.append(("escape" if entered else "missed", (name,)))
        return calls

    def _end(self, name: str, calls: Calls) -> None:
        for rule, _ in calls:
            if rule == "enter":
                self.entered.add(name)
            elif rule == "capture":
                self._captured(name)
            elif rule == "escape":
                self.states[name] = "escaped"
                self.points["intruders"] += 1
            else:
                self.states[name] = "out"

    def _captured(self, name: str) -> None:
        self.states[name] = "captured"
        self.points["pursuers"] += 1

    def _gap(self, name: str, other: str, now: Mapping[str, Pose]) -> float:
        return gap(*(corners(now[n], self.sizes[n]) for n in (name, other)))

    def _strayed(self, course: Course, pose: Pose, clock: float) -> str:
        """The rule by which an intruder counts as captured that leaves its course or is slow; empty if it does not."""
        if abs(aside(course.line, pose)) > ASIDE:
            return "off_course"
        if course.mark is None:
            if clock >= course.since + GETTING_UP - 1e-6:
                course.mark = clock, pose
        elif clock >= course.mark[0] + STRETCH - 1e-6:
            since, there = course.mark
            heading = course.line.theta
            way = (pose.x - there.x) * math.cos(heading) + (pose.y - there.y) * math.sin(heading)
            if way < LEAST * SPEED * (clock - since):
                return "slow"
            course.mark = clock, pose
        return ""


ENDS = ("enter", "capture", "escape", "missed")


def at(way: tuple[Pose, Pose], t: float) -> Vector:
    """Where somebody is at a fraction of a tick."""
    a, b = way
    return a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)


def within(place: Vector, wider: float) -> bool:
    """Whether a place is in the area, or so near to it, m."""
    (x_min, y_min), (x_max, y_max) = SQUARE[0], SQUARE[2]
    return x_min - wider <= place[0] <= x_max + wider and y_min - wider <= place[1] <= y_max + wider


def last(holds: Callable[[float], bool], since: float) -> float:
    """The last instant, within one look from the one at which something holds, at which it still does."""
    inside, outside = since, min(1.0, since + 1 / LOOKS)
    if holds(outside):
        return outside
    for _ in range(40):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside


def aside(line: Pose, pose: Pose) -> float:
    """How far a body is to the left of a line, m."""
    far, way = math.hypot(pose.x - line.x, pose.y - line.y), math.atan2(pose.y - line.y, pose.x - line.x)
    return far * math.sin(way - line.theta)


def put(before: Pose, now: Pose) -> bool:
    """Whether a player is farther away than it can have driven: it was put there, and no way counts."""
    return math.dist((before.x, before.y), (now.x, now.y)) > JUMP + SPEED * TICK


class Game:
    """One random game, judged twice.

    Args:
        seed: everything in the game follows from it. decisions: how likely an official decides something in a tick.

    Attributes:
        counted: how many calls of each rule both have made, and how often officials decided what.
    """

    def __init__(self, seed: int, decisions: float) -> None:
        self.rng = rng = random.Random(seed)
        self.decisions = decisions
        players = contestants(rng.randint(1, 3), rng.randint(1, 3), speeds=dict.fromkeys(STARTS, SPEED))
        self.book = PursuitEvasion(Settings(area=SQUARE, launch_window=8.0, time=TIME), players, seed)
        self.match, self.counted, self.time = Match(self.book), Counter[str](), 0.0
        states = dict.fromkeys(self.book.intruders, "waiting")
        self.ledger = Ledger(states, self.book.launches, {player.name: player.size for player in players})
        self.places = {player.name: player.start for player in players}
        self.seen: dict[str, Pose] | None = None
        """Where everybody was at the look before; None if play was not judged then."""
        self.boldness = rng.choice([0.0, 0.7, 1.0])
        """How likely a pursuer drives to an intruder, rather than anywhere."""
        self.drift = {name: rng.choice([0.0, 0.0, 0.0, 0.0, 0.01, -0.01]) for name in states}
        """By how much an intruder turns in a tick, rad."""
        self.pace = {name: rng.choice([1.0, 1.0, 1.0, 0.65, 0.4]) for name in states}
        """The share of the top speed at which an intruder drives."""

    def play(self) -> Counter[str]:
        """Play the game to its end."""
        match, ledger = self.match, self.ledger
        for _ in range(1000):
            self._decide()
            self.time += TICK
            if match.stage is Stage.PLAY_ROUND:
                self.places = {name: self._moved(name) for name in self.places}
            begun = match.stage
            outcome = match.step(TICK, Observation(self.places, time=self.time), [])
            made = [(call.rule, call.players) for call in outcome.calls]
            self.counted.update(rule for rule, _ in made)
            if len(ledger.out) == len(self.places) and not ledger.back:
                assert match.winner == "draw"
                return self.counted
            if begun is Stage.PLAY_ROUND:
                self._judged(made)
            elif match.stage is Stage.PLAY_ROUND:
                self.seen = dict(self.places)
            self.places = {**self.places, **outcome.place}
            if match.over:
                red, blue = ledger.points["pursuers"], ledger.points["intruders"]
                assert match.winner == ("draw" if red == blue else "pursuers" if red > blue else "intruders")
                return self.counted
        raise AssertionError("expected the game to end")

    def _judged(self, made: Calls) -> None:
        """Compare the calls of a tick of play, and what follows from them."""
        ledger, state = self.ledger, self.match.game
        ruled, sure = ledger.rule(self.seen, self.places, self.match.clock, made)
        self.counted["looks" if sure else "unsure"] += 1
        assert sorted(ruled) == sorted(made)
        self.seen = dict(self.places)
        assert {n: state.states[n] for n in ledger.states} == ledger.states
        assert (state.points, {*state.entered}) == (ledger.points, ledger.entered)
        over = any(rule in ("time_up", "all_done") for rule, _ in made)
        assert (self.match.stage is Stage.ROUND_OVER) == over

    def _decide(self) -> None:
        rng, match = self.rng, self.match
        while rng.random() < self.decisions * (1.0 if match.stage is Stage.PLAY_ROUND else 2.0):
            official = self._decision()
            self.counted[official.action] += 1
            if official.action is OfficialAction.HALT:
                self._halt()
                continue
            self.ledger.decide(official, lining_up=match.stage is Stage.INITIALIZE)
            effects = decide(match, official, Observation(self.places, time=self.time), [])
            if match.stage is not Stage.INITIALIZE:  # where everybody must stand on its mark
                self.places = {**self.places, **effects.place}

    def _decision(self) -> Official:
        """Something that an official may decide at any time."""
        rng, names = self.rng, sorted(self.places)
        state = rng.choice(["waiting", "crossing", "crossing", "captured", "escaped", "out"])
        choices: list[tuple[OfficialAction, str, str]] = [
            (OfficialAction.SET_SCORE, rng.choice(["pursuers", "intruders"]), str(rng.randrange(4))),
            (OfficialAction.SET_STATE, rng.choice(names), state),
            (OfficialAction.SET_STATE, rng.choice(names), state),
            (OfficialAction.DISQUALIFY, rng.choice(names), rng.choice(["", FAILED])),
            (OfficialAction.REINSTATE, rng.choice(names), ""),
            (
                OfficialAction.PLACE,
                rng.choice(names),
                f"{rng.uniform(-3, 12)} {rng.uniform(-1, 11)} {rng.uniform(0, 360)}",
            ),
            (OfficialAction.HALT, "", ""),
        ]
        action, subject, value = rng.choice(choices)
        return Official(action=action, by="ann", subject=subject or None, value=value or None)

    def _halt(self) -> None:
        """Play is halted for a while, in which robots may be carried; nothing of it is judged."""
        halted = self.match.stage is not Stage.ROUND_OVER and not self.match.over
        decide(self.match, Official(action=OfficialAction.HALT, by="ann"), Observation(self.places), [])
        if self.match.stage is Stage.PLAY_ROUND and self.rng.random() < 0.5:
            name = self.rng.choice(sorted(self.places))
            there = self.places[name]
            self.places = {**self.places, name: Pose(there.x, there.y + self.rng.uniform(-1, 1), there.theta)}
        for _ in range(5):
            self.time += TICK
            assert not self.match.step(TICK, Observation(self.places, time=self.time), [])
        decide(self.match, Official(action=OfficialAction.RESUME, by="ann"), Observation(self.places), [])
        if halted:
            self.seen = None

    def _moved(self, name: str) -> Pose:
        """Where a player is after a tick: intruders drive on, and pursuers to them or anywhere."""
        rng, here = self.rng, self.places[name]
        if name in self.ledger.states:
            if name not in self.ledger.crossing():
                return here
            theta, far = here.theta + self.drift[name], self.pace[name] * SPEED * TICK
            return Pose(here.x + far * math.cos(theta), here.y + far * math.sin(theta), theta)
        prey = self.ledger.crossing()
        if prey and rng.random() < self.boldness:
            aim = self.places[prey[0]]
            way = math.atan2(aim.y - here.y, aim.x - here.x)
        else:
            way = rng.uniform(-math.pi, math.pi)
        far = rng.choice([rng.random(), 1.0]) * SPEED * TICK
        return Pose(here.x + far * math.cos(way), here.y + far * math.sin(way), way)


@pytest.mark.parametrize(
    "chunk", [0, *(pytest.param(chunk, marks=pytest.mark.thorough) for chunk in range(1, ALL_GAMES // GAMES))]
)
def test_the_rule_book_and_a_slow_referee_agree_whatever_officials_decide(chunk: int) -> None:
    counted: Counter[str] = Counter()
    for number in range(GAMES):
        counted += Game(chunk * GAMES + number, decisions=(0.0, 0.01, 0.05, 0.2)[number % 4]).play()
    rules = {"launch", "enter", "capture", "escape", "off_course", "slow", "time_up", "all_done"}
    decided = {"set-score", "set-state", "disqualify", "reinstate", "place", "halt"}
    assert rules | decided <= counted.keys()
    assert counted["unsure"] < 0.1 * counted["looks"]
