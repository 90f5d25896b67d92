"""Random games in which the rule book and a slow referee must agree on every call, and which all come to their end.

The slow referee knows nothing of the rule book: it looks at many instants of each tick, one after the other. Where it
cannot tell within EPSILON what happened, the rule book is believed.
"""

import itertools
import math
import random
from collections import Counter

from vrg.bus.messages import Stage
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Contestant, Observation
from vrg.games.sharks_and_minnows import MINNOW, SHARK
from vrg.games.sharks_and_minnows.rules import SharksAndMinnows
from vrg.games.sharks_and_minnows.settings import Settings
from vrg.types import Pose

TICK, LOOKS = 0.25, 32
EPSILON = 0.01
"""How far in m a slow look may be off: a robot at top speed moves so far from one to the next."""
SIZES = [(0.5, 0.49), (0.78, 0.63), (0.4, 0.2)]
LIMIT = 13.0
GAMES = 9
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

    def inside(self, p: Point, box: Box, off: float) -> bool:
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


def play(seed: int) -> Counter[str]:
    """Play one random game to its end, and count what was called."""
    rng = random.Random(seed)
    settings = Settings.model_validate(
        {"x": (0.0, 8.0), "y": (0.0, 12.0), "zone_depth": 2.0, "passes": 3, "pass_limit": LIMIT, "slowest": 1.0}
    )
    players = [
        Contestant(
            name=name, role=role, start=Pose(0.6 + 2.2 * (number % 4), y, theta), size=rng.choice(SIZES), v_max=1.0
        )
        for role, names, y, theta in ((SHARK, "st", 1.0, 1.57), (MINNOW, "abcd", 11.0, -1.57))
        for number, name in enumerate(names)
    ]
    book = SharksAndMinnows(settings, players, seed)
    sizes = {player.name: player.size for player in players}
    match, counted, time = Match(book), Counter[str](), 0.0
    places = {player.name: player.start for player in players}
    pace = (0.02, 0.2, 1.0)[seed % 3]  # of sharks
    for _ in range(2000):
        time += TICK
        before, was = dict(places), match.game
        if match.stage is Stage.INITIALIZE:
            places = dict(match.game.marks)
        elif match.stage is Stage.PLAY_ROUND:
            paces = dict.fromkeys(match.game.active(SHARK), pace)
            places = {name: moved(rng, book, match, name, places, paces.get(name, 1.0)) for name in places}
        begun = match.stage
        outcome = match.step(TICK, Observation(places, time=time), [])
        if begun is Stage.PLAY_ROUND:
            zone = settings.end_zone(was.goal).bounds
            roles = [sorted(was.active(SHARK)), sorted(was.active(MINNOW))]
            ruled = [
                SlowReferee(settings, sizes, LIMIT, off).calls(*roles, zone, before, places, match.clock)
                for off in (-EPSILON, 0.0, EPSILON)
            ]
            made = {(call.rule, call.players) for call in outcome.calls}
            sure = all(one == other for one, other in itertools.pairwise(ruled))
            counted["looks" if sure else "unsure"] += 1
            assert not sure or made == ruled[0], (seed, time, made, ruled[0])
        counted.update(call.rule for call in outcome.calls)
        if match.over:
            return counted
    raise AssertionError(f"expected game {seed} to end")


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
        counted += play(seed)
    assert {"tag", "out_of_bounds", "pass_limit", "pass_over", "new_shark", "game_over"} <= counted.keys()
    assert counted["unsure"] < 0.1 * counted["looks"]
