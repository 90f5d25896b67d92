"""Random games in which the rule book and a slow referee must agree on every call, and which all come to their end.

The slow referee knows nothing of the rule book: it looks at many instants of each tick, one after the other. Where it
cannot tell within EPSILON what happened, the rule book is believed.
"""

import itertools
import math
import random
from collections import Counter
from dataclasses import dataclass, field
from types import FunctionType

import pytest

from tests.games.mistakes import plant
from vrg.bus.messages import FAILED, Official, OfficialAction, Stage
from vrg.coordinator.decisions import decide
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Contestant, Observation
from vrg.games.sharks_and_minnows import MINNOW, SHARK, judging
from vrg.games.sharks_and_minnows.rules import SharksAndMinnows
from vrg.games.sharks_and_minnows.settings import Settings
from vrg.types import Pose

TICK, LOOKS = 0.25, 32
EPSILON = 0.01
"""How far in m a slow look may be off: a robot at top speed moves so far from one to the next."""
SIZES = [(0.5, 0.49), (0.78, 0.63), (0.4, 0.2)]
LIMIT = 13.0
JUMP = 0.5
"""How far beyond what it can drive a player is, m, if it was put there."""
PASSES = 3
GAMES, OFFICIAL_GAMES = 9, 999
Point = tuple[float, float]
Box = tuple[float, float, float, float]


def corners(pose: Pose, size: Point) -> list[Point]:
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    half = [(size[0] / 2 * a, size[1] / 2 * b) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    return [(pose.x + c * u - s * v, pose.y + s * u + c * v) for u, v in half]


def from_side(p: Point, a: Point, b: Point) -> float:
    along = ((p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1])) / math.dist(a, b) ** 2
    t = max(0.0, min(1.0, along))
    return math.dist(p, (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))


def within(p: Point, shape: list[Point]) -> bool:
    turned = [*shape[1:], shape[0]]
    return all(
        (b[0] - a[0]) * (p[1] - a[1]) >= (b[1] - a[1]) * (p[0] - a[0]) for a, b in zip(shape, turned, strict=True)
    )


def gap(a: list[Point], b: list[Point]) -> float:
    """The distance of two rectangles. Where they cross without a corner inside, they were near before already."""
    if any(within(p, b) for p in a) or any(within(p, a) for p in b):
        return 0.0
    sides = [(b, a, [*a[1:], a[0]]), (a, b, [*b[1:], b[0]])]
    return min(
        from_side(p, one, two)
        for points, ones, twos in sides
        for p in points
        for one, two in zip(ones, twos, strict=True)
    )


class SlowReferee:
    """One pass as it is played.

    Args:
        off: moves every border and the tag distance by so much, m.
    """

    def __init__(self, settings: Settings, sizes: dict[str, Point], limit: float, off: float) -> None:
        self.settings, self.sizes, self.limit, self.off = settings, sizes, limit, off

    @staticmethod
    def inside(p: Point, box: Box, off: float) -> bool:
        return box[0] - off <= p[0] <= box[2] + off and box[1] - off <= p[1] <= box[3] + off

    def calls(
        self,
        sharks: list[str],
        minnows: list[str],
        zone: Box,
        before: dict[str, Pose],
        now: dict[str, Pose],
        clock: float,
    ) -> set[tuple[str, tuple[str, ...]]]:
        field = self.settings.field.bounds
        reach = self.settings.tag_distance + self.off
        gone: set[str] = set()
        told: set[tuple[str, tuple[str, ...]]] = set()
        near = {(m, s) for m in minnows for s in sharks if math.dist((now[m].x, now[m].y), (now[s].x, now[s].y)) < 2.5}
        for look in range(LOOKS + 1):
            t = look / LOOKS
            there = {
                n: Pose(
                    before[n].x + t * (now[n].x - before[n].x),
                    before[n].y + t * (now[n].y - before[n].y),
                    before[n].theta + t * math.remainder(now[n].theta - before[n].theta, math.tau),
                )
                for n in [*sharks, *minnows]
            }
            for m in [m for m in minnows if m not in gone]:
                if self.inside((there[m].x, there[m].y), zone, self.off):
                    continue
                body = corners(there[m], self.sizes[m])
                by = [
                    s
                    for s in sharks
                    if s not in gone and (m, s) in near and gap(body, corners(there[s], self.sizes[s])) <= reach
                ]
                if by:
                    gone.add(m)
                    told.add(("tag", (m, *sorted(by))))
            for n in [n for n in there if n not in gone and not self.inside((there[n].x, there[n].y), field, self.off)]:
                gone.add(n)
                told.add(("out_of_bounds", (n,)))
        left = [m for m in minnows if m not in gone]
        late = [m for m in left if not self.inside((now[m].x, now[m].y), zone, self.off)]
        if clock >= self.limit - 1e-6:
            told |= {("pass_limit", (m,)) for m in late}
            left, late = [m for m in left if m not in late], []
        if not late:
            told.add(("pass_over", tuple(sorted(left))))
        return told


@dataclass
class Ledger:
    """What a slow referee remembers, by the calls and by what officials decide.

    Args:
        roles: of each player. goal: the end to which minnows cross.
    """

    roles: dict[str, str]
    goal: str = "low"
    states: dict[str, str] = field(default_factory=dict)
    points: dict[str, int] = field(default_factory=lambda: {"sharks": 0, "minnows": 0})
    number: int = 1
    """Of the pass."""
    out: dict[str, bool] = field(default_factory=dict)
    """The disqualified players; True if an official has decided it."""
    back: set[str] = field(default_factory=set)
    """Those of them that play again from the next pass."""

    def __post_init__(self) -> None:
        self.states = dict.fromkeys(self.roles, "active")

    def active(self, role: str) -> list[str]:
        """The players of a role that play."""
        return sorted(
            n for n, r in self.roles.items() if r == role and self.states[n] == "active" and n not in self.out
        )

    def decide(self, official: Official, *, lining_up: bool) -> None:
        """Take in a decision; one that is impossible changes nothing."""
        name, value = official.subject or "", official.value or ""
        match official.action:
            case OfficialAction.SET_SCORE:
                self.points[name] = int(value)
            case OfficialAction.SET_ROLE:
                self.roles[name] = value
            case OfficialAction.SET_STATE:
                self.states[name] = value
            case OfficialAction.DISQUALIFY if value != FAILED or not self.out.get(name):
                self.out[name] = value != FAILED
                self.back.discard(name)
            case OfficialAction.REINSTATE if name in self.out and lining_up:
                del self.out[name]
                self.back.discard(name)
            case OfficialAction.REINSTATE if name in self.out:
                self.back.add(name)

    def called(self, calls: set[tuple[str, tuple[str, ...]]]) -> None:
        """Take in the calls of a tick of play, in which the disqualified are as inactive as the tagged."""
        self.states.update(dict.fromkeys(self.out, "inactive"))
        for rule, players in calls:
            if rule == "pass_over":
                self.points["minnows"] += len(players)
            else:
                self.states[players[0]] = "inactive"
                self.points["sharks"] += self.roles[players[0]] == MINNOW

    def go_on(self) -> str | None:
        """The winner after a pass; None if there is another pass."""
        for name in self.back:
            del self.out[name]
        self.back.clear()
        self.states.update(dict.fromkeys(self.out, "inactive"))
        if not self.active(MINNOW):
            return "sharks"
        if self.number >= PASSES:
            return "minnows"
        self.roles |= {name: SHARK for name, state in self.states.items() if state == "inactive"}
        self.states = dict.fromkeys(self.states, "active")
        self.number, self.goal = self.number + 1, "high" if self.goal == "low" else "low"
        return None


def decision(rng: random.Random, names: list[str]) -> Official:
    """Something that an official may decide at any time."""
    choices: list[tuple[OfficialAction, str, str]] = [
        (OfficialAction.SET_SCORE, rng.choice(["sharks", "minnows"]), str(rng.randrange(9))),
        (OfficialAction.SET_ROLE, rng.choice(names), rng.choice([SHARK, MINNOW, MINNOW])),
        (OfficialAction.SET_STATE, rng.choice(names), rng.choice(["active", "active", "inactive"])),
        (OfficialAction.DISQUALIFY, rng.choice(names), rng.choice(["", FAILED])),
        (OfficialAction.REINSTATE, rng.choice(names), ""),
        (OfficialAction.REINSTATE, rng.choice(names), ""),
        (OfficialAction.PLACE, rng.choice(names), f"{rng.uniform(0, 8)} {rng.uniform(0, 12)} {rng.uniform(0, 360)}"),
        (OfficialAction.HALT, "", ""),
    ]
    action, subject, value = rng.choice(choices)
    return Official(action=action, by="ann", subject=subject or None, value=value or None)


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
        self.settings = Settings.model_validate(
            {
                "x": (0.0, 8.0),
                "y": (0.0, 12.0),
                "zone_depth": 2.0,
                "passes": PASSES,
                "pass_limit": LIMIT,
                "slowest": 1.0,
            }
        )
        players = [
            Contestant(
                name=name, role=role, start=Pose(0.6 + 2.2 * (number % 4), y, theta), size=rng.choice(SIZES), v_max=1.0
            )
            for role, names, y, theta in ((SHARK, "st", 1.0, 1.57), (MINNOW, "abcd", 11.0, -1.57))
            for number, name in enumerate(names)
        ]
        self.book = SharksAndMinnows(self.settings, players, seed)
        self.match, self.counted, self.time = Match(self.book), Counter[str](), 0.0
        sizes = {player.name: player.size for player in players}
        self.referees = [SlowReferee(self.settings, sizes, LIMIT, off) for off in (-EPSILON, 0.0, EPSILON)]
        self.ledger = Ledger({player.name: player.role for player in players})
        self.places = {player.name: player.start for player in players}
        self.seen: dict[str, Pose] | None = None
        """Where everybody was at the look before; None if play was not judged then."""
        self.pace = (0.02, 0.2, 1.0)[seed % 3]  # of sharks

    def play(self) -> Counter[str]:
        """Play the game to its end."""
        match, ledger = self.match, self.ledger
        for _ in range(4000):
            self.time += TICK
            self._decide()
            self._move()
            begun, judged = match.stage, match.halted is None
            outcome = match.step(TICK, Observation(self.places, time=self.time), [])
            self.counted.update(call.rule for call in outcome.calls)
            if len(ledger.out) == len(self.places) and not ledger.back:
                assert match.winner == "draw"
                return self.counted
            if not judged:
                assert not outcome
                self.seen = None
            elif begun is Stage.PLAY_ROUND:
                self._judged({(call.rule, call.players) for call in outcome.calls})
            elif match.stage is Stage.PLAY_ROUND:
                self._begun()
            elif begun is Stage.ROUND_OVER and match.stage is not begun:
                assert match.winner == ledger.go_on()
            state, playing = match.game, [name for name in self.places if name not in ledger.out]
            assert (state.roles, state.points) == (ledger.roles, ledger.points)
            assert [state.states[n] for n in playing] == [ledger.states[n] for n in playing]
            assert (state.round, state.goal, {*match.disqualified}) == (ledger.number, ledger.goal, {*ledger.out})
            if match.over:
                return self.counted
        raise AssertionError("expected the game to end")

    def _decide(self) -> None:
        between = self.match.stage is not Stage.PLAY_ROUND  # that takes few ticks
        while self.rng.random() < self.decisions * (2.0 if between else 1.0):
            official = decision(self.rng, sorted(self.places))
            self.ledger.decide(official, lining_up=self.match.stage is Stage.INITIALIZE)
            effects = decide(self.match, official, Observation(self.places, time=self.time), [])
            self.places = {**self.places, **effects.place}
            self.counted[official.action] += 1
        if self.match.halted is not None and self.rng.random() < 0.2:
            resume = Official(action=OfficialAction.RESUME, by="ann")
            decide(self.match, resume, Observation(self.places, time=self.time), [])

    def _move(self) -> None:
        if self.match.stage is Stage.INITIALIZE:
            marks = self.match.game.marks
            on_marks = {name: mark for name, mark in marks.items() if name not in self.ledger.out}
            self.places = {**self.places, **on_marks}
        elif self.match.stage is Stage.PLAY_ROUND:
            paces = dict.fromkeys(self.ledger.active(SHARK), self.pace)
            self.places = {
                name: moved(self.rng, self.book, self.match, name, self.places, paces.get(name, 1.0))
                for name in self.places
            }

    def _judged(self, made: set[tuple[str, tuple[str, ...]]]) -> None:
        """Compare the calls of a tick of play."""
        ledger, now = self.ledger, self.places
        zone = self.settings.end_zone(ledger.goal).bounds
        roles = ledger.active(SHARK), ledger.active(MINNOW)
        before = {n: now[n] if put(pose, now[n]) else pose for n, pose in (self.seen or now).items()}
        ruled = [slow.calls(*roles, zone, before, now, self.match.clock) for slow in self.referees]
        sure = all(one == other for one, other in itertools.pairwise(ruled))
        self.counted["looks" if sure else "unsure"] += 1
        assert not sure or made == ruled[0]
        ledger.called(made)
        assert (self.match.stage is Stage.ROUND_OVER) == any(rule == "pass_over" for rule, _ in made)
        self.seen = dict(now)

    def _begun(self) -> None:
        """Minnows begin at the other end than that to which they cross."""
        zone = self.settings.end_zone(self.ledger.goal).bounds
        playing = [name for name in self.places if name not in self.ledger.out]
        there = [n for n in playing if SlowReferee.inside((self.places[n].x, self.places[n].y), zone, 0.0)]
        assert there == [name for name in playing if self.ledger.roles[name] == SHARK]
        self.seen = dict(self.places)


def put(before: Pose, now: Pose) -> bool:
    """Whether a player is farther away than it can have driven: it was put there, and no way counts."""
    return math.dist((before.x, before.y), (now.x, now.y)) > JUMP + TICK


def moved(
    rng: random.Random, book: SharksAndMinnows, match: Match, name: str, places: dict[str, Pose], pace: float
) -> Pose:
    """Where a player is after a tick: mostly minnows head for their zone and sharks for a minnow."""
    here, state = places[name], match.game
    prey = [m for m in state.active(MINNOW) if m != name]
    if name not in state.active(SHARK) and name not in state.active(MINNOW):
        return here
    if state.roles[name] == MINNOW:
        aim = (
            (here.x, 13.0 if state.goal == "high" else -1.0)
            if rng.random() < 0.7
            else (-4.0 if ord(name) % 2 else 12.0, here.y)
        )
        if book.safe_zone(state).contains(here.x, here.y) and rng.random() < 0.95:
            return here
    else:
        target = (
            places[min(prey, key=lambda m: math.dist((here.x, here.y), (places[m].x, places[m].y)))] if prey else here
        )
        aim = (target.x, target.y) if rng.random() < 0.25 else (rng.uniform(-1, 9), rng.uniform(-1, 13))
    way, far = math.atan2(aim[1] - here.y, aim[0] - here.x), rng.uniform(0.5, 1.0) * pace * TICK
    theta = here.theta + max(-0.4, min(0.4, math.remainder(way - here.theta, math.tau)))
    return Pose(here.x + far * math.cos(theta), here.y + far * math.sin(theta), math.remainder(theta, math.tau))


def test_the_rule_book_and_a_slow_referee_agree_on_every_call() -> None:
    counted: Counter[str] = Counter()
    for seed in range(GAMES):
        counted += Game(seed, decisions=0.0).play()
    assert {"tag", "out_of_bounds", "pass_limit", "pass_over", "new_shark", "game_over"} <= counted.keys()
    assert counted["unsure"] < 0.1 * counted["looks"]


@pytest.mark.parametrize(
    "chunk", [0, *(pytest.param(chunk, marks=pytest.mark.thorough) for chunk in range(1, OFFICIAL_GAMES // GAMES))]
)
def test_they_agree_whatever_officials_decide(chunk: int) -> None:
    counted: Counter[str] = Counter()
    for seed in range(GAMES):
        counted += Game(1000 + chunk * GAMES + seed, decisions=(0.02, 0.1, 0.3)[seed % 3]).play()
    decided = {"set-score", "set-role", "set-state", "disqualify", "reinstate", "place", "halt"}
    assert {"tag", "out_of_bounds", "pass_over", "game_over", *decided} <= counted.keys()


@pytest.mark.parametrize(
    ("function", "old", "new"),
    [
        (judging.find_outs, "if outs[n] == STAYS and not (", "if outs[n] == STAYS and (late or not "),
        (judging.find_outs, "at < math.inf", "at < 0.5"),
        (judging.tagged_at, "s.tag_distance, refuge", "1.1 * s.tag_distance, refuge"),
    ],
)
def test_they_disagree_where_the_rule_book_makes_a_mistake(
    function: FunctionType, old: str, new: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(monkeypatch, function, old, new)
    with pytest.raises(AssertionError):
        test_the_rule_book_and_a_slow_referee_agree_on_every_call()
