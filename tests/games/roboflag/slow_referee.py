"""A second referee of RoboFlag, written from the text of the rules alone: plain, slow, and with a geometry of its own.

It shares no code with the rule book. It is told where everybody is at each tick, and says what the rules make of the
straight ways since the tick before. It finds the decisive instants by halving; the rule book solves equations.
"""

import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction

Place = tuple[float, float]
Way = tuple[Place, Place]
"""Where something was at the tick before and where it is now. In between it moves straight and evenly."""
Stretch = tuple[float, float]
"""A part of the time between two ticks, as fractions of it."""
ROUNDING = 1e-9
"""What numbers may be wrong by, m or a fraction of a tick."""
JUMP = 0.5
"""Whoever is farther than this from where it can have driven since, m, has been put there: no way counts."""
Ruling = tuple[str, tuple[str, ...]]
"""A rule and the players whom it concerns: whoever it happens to first, then the others in the order of their names."""

OPPONENTS = {"red": "blue", "blue": "red"}
NORMAL, TAGGED, FLAGGED = "normal", "tagged", "flagged"


@dataclass(frozen=True)
class Ground:
    """The field and the numbers of a match, all as they are at scale 1, except for the centre.

    Args:
        centre: the centre of the field, m. scale: by what everything else is multiplied.
        length, width: the size of the field. Red has the half of low x.
        homes: by team, whether its home is in the corner with the `low` or the `high` y. flags: where its flag is,
            from the centre.
        tag, reach, home, zone: the tag distance, the reach of the flag and of the home, the radius of the flag zones.
    """

    centre: Place
    scale: float
    length: float
    width: float
    homes: Mapping[str, str]
    flags: Mapping[str, Place]
    tag: float
    reach: float
    home: float
    zone: float

    def flag(self, team: str) -> Place:
        """Where the flag of a team stands."""
        x, y = self.flags[team]
        return self.centre[0] + x * self.scale, self.centre[1] + y * self.scale

    def corner(self, team: str) -> Place:
        """The corner of a team's home."""
        aside = -1 if team == "red" else 1
        up = -1 if self.homes[team] == "low" else 1
        return (
            self.centre[0] + aside * self.scale * self.length / 2,
            self.centre[1] + up * self.scale * self.width / 2,
        )

    def on_half_of(self, team: str, place: Place) -> bool:
        """Whether a place is on a team's half; the midline is on both, and a half does not end at the borders."""
        return place[0] <= self.centre[0] if team == "red" else place[0] >= self.centre[0]

    def in_a_flag_zone(self, place: Place) -> bool:
        """Whether a place is in one of the two flag zones."""
        return any(near(place, self.flag(team), self.zone * self.scale) for team in OPPONENTS)


@dataclass
class SlowReferee:
    """The referee, and all that it remembers.

    Args:
        ground: the field. teams: the team of each player.
        tick: the time between two ticks, s; exact, so that the end of a round is.
        round_time, sudden_death: how long rounds last, s. enough: the captures that end the game at once.
        speed: the top speed of all players, m/s.
    """

    ground: Ground
    teams: Mapping[str, str]
    tick: Fraction
    round_time: Fraction
    sudden_death: Fraction
    enough: int = 3
    speed: float = 0.7

    round: int = 1
    ticks: int = 0
    states: dict[str, str] = field(default_factory=dict)
    carriers: dict[str, str | None] = field(default_factory=dict)
    """Who carries the flag of a team; None if it stands in its place."""
    captures: dict[str, int] = field(default_factory=lambda: {"red": 0, "blue": 0})
    out: set[str] = field(default_factory=set)
    """The disqualified players."""
    suddenly: bool = False
    """Whether this round is the sudden death."""
    round_over: bool = False
    winner: str | None = None
    before: dict[str, Place] = field(default_factory=dict)
    """Where everybody was at the tick before; empty if there is none of this play."""

    def __post_init__(self) -> None:
        self._reset()

    def _reset(self) -> None:
        self.states = dict.fromkeys(self.teams, NORMAL)
        self.carriers = {"red": None, "blue": None}
        self.before = {}
        self.ticks = 0
        self.round_over = False

    def play(self, places: Mapping[str, Place]) -> list[Ruling]:
        """One tick of play."""
        assert not self.round_over, "nobody plays when the round is over"
        self.ticks += 1
        ways = {name: self._way(name, place) for name, place in places.items()}
        self.before = dict(places)
        captures = dict(self.captures)
        rulings = self._returns()
        rulings += self._homes(ways)
        rulings += self._flags(ways)
        rulings += self._tags(ways)
        enough = any(number >= self.enough for number in self.captures.values())
        untied = self.captures["red"] != self.captures["blue"]
        if (untied or self.captures != captures) if self.suddenly else enough:
            self.round_over = True
        elif self.ticks * self.tick >= (self.sudden_death if self.suddenly else self.round_time):
            rulings.append(("time", ()))
            self.round_over = True
        return rulings

    def _way(self, name: str, place: Place) -> Way:
        """The way of a player since the tick before; it stood where it is if that is not known."""
        start = self.before.get(name, place)
        return (start, place) if near(start, place, JUMP + self.speed * float(self.tick)) else (place, place)

    def set_state(self, name: str, state: str) -> None:
        """An official puts a player into a state. A flag that another player carries is not given to it."""
        opponents = OPPONENTS[self.teams[name]]
        if state == FLAGGED and self.carriers[opponents] not in (None, name):
            return
        if state == FLAGGED:
            self.carriers[opponents] = name
        elif self.carriers[opponents] == name:
            self.carriers[opponents] = None
        self.states[name] = state

    def go_on(self) -> list[Ruling]:
        """What follows after a round: the end of the game with its winner, or the next round."""
        assert self.round_over
        red, blue = self.captures["red"], self.captures["blue"]
        leader = "draw" if red == blue else "red" if red > blue else "blue"
        if self.suddenly:
            self.winner = leader
            return []
        last = self.round == 2 or max(red, blue) >= self.enough
        if last and leader != "draw":
            self.winner = leader
            return []
        self._reset()
        self.round += 1
        if last:
            self.suddenly = True
            return [("sudden_death", ())]
        return []

    def _players(self, team: str | None = None) -> list[str]:
        return sorted(n for n, t in self.teams.items() if n not in self.out and team in (None, t))

    def _returns(self) -> list[Ruling]:
        """A flag whose carrier is disqualified returns."""
        rulings: list[Ruling] = []
        for team in ("red", "blue"):
            carrier = self.carriers[team]
            if carrier is not None and carrier in self.out:
                self.carriers[team] = None
                self.states[carrier] = NORMAL
                rulings.append(("flag_returns", (carrier,)))
        return rulings

    def _homes(self, ways: Mapping[str, Way]) -> list[Ruling]:
        """At home any player becomes normal; a carrier scores."""
        rulings: list[Ruling] = []
        for name in self._players():
            team = self.teams[name]
            reach = self.ground.home * self.ground.scale
            if self.states[name] == NORMAL or when_near(ways[name], standing(self.ground.corner(team)), reach) is None:
                continue
            if self.states[name] == FLAGGED:
                assert self.carriers[OPPONENTS[team]] == name
                self.carriers[OPPONENTS[team]] = None
                self.captures[team] += 1
                rulings.append(("capture", (name,)))
            else:
                rulings.append(("home", (name,)))
            self.states[name] = NORMAL
        return rulings

    def _flags(self, ways: Mapping[str, Way]) -> list[Ruling]:
        """The first normal opponent in reach of a flag that stands in its place takes it; of several the nearest."""
        rulings: list[Ruling] = []
        for team in ("red", "blue"):
            if self.carriers[team] is not None:
                continue
            stand, reach = self.ground.flag(team), self.ground.reach * self.ground.scale
            takers = []
            for name in self._players(OPPONENTS[team]):
                stretch = when_near(ways[name], standing(stand), reach)
                if self.states[name] == NORMAL and stretch is not None:
                    takers.append((stretch[0], squared(at(ways[name], stretch[0]), stand), name))
            if takers:
                taker = sorted(takers)[0][2]
                self.carriers[team] = taker
                self.states[taker] = FLAGGED
                rulings.append(("flag", (taker,)))
        return rulings

    def _tags(self, ways: Mapping[str, Way]) -> list[Ruling]:
        """All who can be tagged, and are near an opponent who is not tagged himself, are tagged at once."""
        tagged: list[tuple[str, list[str]]] = []
        for name in self._players():
            opponents = self._players(OPPONENTS[self.teams[name]])
            by = [other for other in opponents if self._tags_him(name, other, ways)]
            if by:
                tagged.append((name, by))
        for name, _ in tagged:
            self.states[name] = TAGGED
            for team in ("red", "blue"):
                if self.carriers[team] == name:
                    self.carriers[team] = None
        return [("tag", (name, *by)) for name, by in tagged]

    def _tags_him(self, name: str, other: str, ways: Mapping[str, Way]) -> bool:
        """Whether another player tags this one: whether there is an instant at which all that it takes is so."""
        if TAGGED in (self.states[name], self.states[other]):
            return False
        g, way = self.ground, ways[name]
        reach = when_near(way, ways[other], g.tag * g.scale)
        if reach is None:
            return False
        zones = [when_near(way, standing(g.flag(team)), g.zone * g.scale) for team in ("red", "blue")]
        safe = [zone for zone in zones if zone is not None]
        decisive = {*reach, *(end for zone in safe for end in zone), *self._crossing(way)}
        instants = sorted(t for t in decisive if reach[0] <= t <= reach[1])
        instants += [(a + b) / 2 for a, b in itertools.pairwise(instants)]
        half = OPPONENTS[self.teams[name]]
        return any(
            (self.states[name] == FLAGGED or g.on_half_of(half, at(way, t)) or t in self._crossing(way))
            and not any(start - ROUNDING <= t <= end + ROUNDING for start, end in safe)
            for t in instants
        )

    def _crossing(self, way: Way) -> list[float]:
        """When a way meets the midline, if it crosses it."""
        (x, _), (end, _) = way
        middle = self.ground.centre[0]
        return [(middle - x) / (end - x)] if (x - middle) * (end - middle) < 0 else []


def standing(place: Place) -> Way:
    """The way of something that does not move."""
    return place, place


def at(way: Way, t: float) -> Place:
    """Where on its way something is at a fraction of the time."""
    if t in (0.0, 1.0):
        return way[int(t)]
    return way[0][0] + t * (way[1][0] - way[0][0]), way[0][1] + t * (way[1][1] - way[0][1])


def when_near(one: Way, two: Way, distance: float) -> Stretch | None:
    """When two that move were at most a distance apart; None if they never were. The bounds are found by halving."""

    def close(t: float) -> bool:
        return near(at(one, t), at(two, t), distance)

    start, end = (two[0][0] - one[0][0], two[0][1] - one[0][1]), (two[1][0] - one[1][0], two[1][1] - one[1][1])
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = dx * dx + dy * dy
    nearest = 0.0 if length == 0 else min(1.0, max(0.0, -(start[0] * dx + start[1] * dy) / length))
    if not close(nearest):
        return None
    return _bound(close, nearest, 0.0), _bound(close, nearest, 1.0)


def _bound(close: Callable[[float], bool], inside: float, outside: float) -> float:
    """The last instant from one that is inside towards another one at which it is still so."""
    if close(outside):
        return outside
    for _ in range(50):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if close(middle) else (inside, middle)
    return inside


def squared(a: Place, b: Place) -> float:
    """The square of the distance of two places."""
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])


def near(a: Place, b: Place, distance: float) -> bool:
    """Whether two places are at most a distance apart."""
    return squared(a, b) <= (distance + ROUNDING) ** 2


def in_order(rulings: Iterable[Ruling]) -> list[Ruling]:
    """Rulings in the order of the rules, those of one rule by the names of their players."""
    rank = {"flag_returns": 0, "capture": 1, "home": 1, "flag": 2, "tag": 3, "time": 4, "sudden_death": 5}
    return sorted(rulings, key=lambda ruling: (rank[ruling[0]], ruling))
