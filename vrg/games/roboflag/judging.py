"""The judgement of RoboFlag at one look (thesis, Algorithm 4.3): first home, then the flag, then tags.

Each part judges the whole ways of the players since the look before, so that none jumps over anything. Each function
takes the state and these ways, and returns the new state and the calls. Distances are between centres, and a player at
exactly the distance is near enough.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from msgspec import structs

from vrg.bus.messages import FieldObject
from vrg.coordinator.rulebook import Call, GameState, called
from vrg.games.roboflag import FLAGGED, NORMAL, TAGGED, TEAMS, flag_of, other
from vrg.games.roboflag.layout import FieldLayout
from vrg.geometry import interpolate
from vrg.segments import NEVER, Stretch, disc_part
from vrg.types import Pose, Vector


class State(GameState, frozen=True, kw_only=True):
    """Everything that the rule book of this game remembers. The flags are among its `objects`.

    A team has a point for each flag that it has captured.

    Args:
        marks: where each player lines up for this round: at one of the starts of its team.
    """

    marks: Mapping[str, Pose]

    def flag(self, team: str) -> FieldObject:
        """The flag of a team."""
        return next(thing for thing in self.objects if thing.name == flag_of(team))

    def with_carrier(self, team: str, carrier: str | None) -> "State":
        """The same, but with this player as the carrier of the team's flag; None puts the flag back to its place."""
        changed = structs.replace(self.flag(team), carrier=carrier)
        return structs.replace(self, objects=tuple(changed if t.name == changed.name else t for t in self.objects))


Judged = tuple[State, list[Call]]
"""The new state, and the calls in order."""
ROUNDING = 1e-9
"""The distance in m by which a player may be farther away than a limit, because numbers are rounded; and the fraction
of the time between two looks by which two instants may differ that are the same."""


@dataclass(frozen=True)
class Ways:
    """The ways of the players in play between two looks.

    Args:
        before, now: the pose of each at the two looks. A player that is not in `before` stood where it is.
        teams: the team of each.
    """

    before: Mapping[str, Pose]
    now: Mapping[str, Pose]
    teams: Mapping[str, str]

    def of(self, name: str) -> tuple[Vector, Vector]:
        """The places at which a player was and is, m."""
        now, before = self.now[name], self.before.get(name)
        end = (now.x, now.y)
        return (end, end) if before is None else ((before.x, before.y), end)

    def pose(self, name: str, at: float) -> Pose:
        """The pose of a player at a fraction of the time between the looks."""
        return interpolate(self.before.get(name, self.now[name]), self.now[name], at)

    def within(self, name: str, place: Vector, reach: float) -> Stretch:
        """The stretch in which a player was within `reach` m of a place."""
        return inside(*self.of(name), place, reach)

    def near(self, one: str, two: str, reach: float) -> Stretch:
        """The stretch in which two players were within `reach` m of each other."""
        return near(*self.of(one), *self.of(two), reach)

    def call(self, rule: str, text: str, at: float, *names: str) -> Call:
        """A call about these players, with their poses at a fraction of the time between the looks."""
        return called(rule, text, {name: self.pose(name, at) for name in names})


def judge_homes(state: State, layout: FieldLayout, ways: Ways) -> Judged:
    """A player that came in reach of its own home becomes normal; a carrier scores there, and the flag returns."""
    calls = []
    for name in sorted(ways.now):
        team, before = ways.teams[name], state.states[name]
        if before == NORMAL:
            continue
        home = layout.home(team)
        stretch = ways.within(name, (home.x, home.y), layout.home_reach)
        if stretch == NEVER:
            continue
        state = state.with_state([name], NORMAL)
        if before == TAGGED:
            calls.append(ways.call("home", f"{name} is at home and plays again", stretch[0], name))
            continue
        state = state.with_carrier(other(team), None).with_points(team, state.points[team] + 1)
        score = " to ".join(str(state.points[t]) for t in (team, other(team)))
        text = f"{name} captures the flag of {other(team)}: {score} for {team}"
        calls.append(ways.call("capture", text, stretch[0], name))
    return state, calls


def judge_flags(state: State, layout: FieldLayout, ways: Ways) -> Judged:
    """A normal player that came in reach of the opponents' flag takes it.

    Among several it is the first, among those at the same instant the nearest, and then the first by name. A
    flag has one carrier, and a team has one flag to take, so no player carries two.
    """
    calls = []
    for team in TEAMS:
        place = layout.flag(team)
        takers = []
        for name in ways.now:
            if ways.teams[name] == other(team) and state.states[name] == NORMAL:
                stretch = ways.within(name, place, layout.flag_reach)
                if stretch != NEVER:
                    pose = ways.pose(name, stretch[0])
                    takers.append((stretch[0], math.dist((pose.x, pose.y), place), name))
        if takers and state.flag(team).carrier is None:
            at, _, taker = min(takers)
            state = state.with_state([taker], FLAGGED).with_carrier(team, taker)
            calls.append(ways.call("flag", f"{taker} takes the flag of {team}", at, taker))
    return state, calls


def judge_tags(state: State, layout: FieldLayout, ways: Ways) -> Judged:
    """Judge all tags by the state before any of them, so that two players can tag each other.

    Opponents that are not tagged themselves tag. A normal player can be tagged on the opponents' half, and a carrier
    anywhere; no player can be inside a flag zone. The flag of a tagged carrier returns to its place.
    """
    tags = [(name, by) for name in sorted(ways.now) if (by := _tags_of(state, layout, ways, name))]
    calls = []
    for name, by in tags:
        back = ""
        if state.states[name] == FLAGGED:
            opponents = other(ways.teams[name])
            state = state.with_carrier(opponents, None)
            back = f", and the flag of {opponents} returns"
        state = state.with_state([name], TAGGED)
        text = f"{name} is tagged by {' and '.join(by)}{back}"
        calls.append(ways.call("tag", text, min(by.values()), name, *by))
    return state, calls


def _tags_of(state: State, layout: FieldLayout, ways: Ways, name: str) -> dict[str, float]:
    """The players that tag this one, sorted by name, and when each first does."""
    team, status = ways.teams[name], state.states[name]
    if status == TAGGED:
        return {}
    start, end = ways.of(name)
    exposed = (0.0, 1.0) if status == FLAGGED else invasion(start[0], end[0], layout.midline, layout.ahead(team))
    one, two = (inside(start, end, (zone.x, zone.y), zone.radius) for zone in layout.flag_zones())
    found = {}
    for by in sorted(ways.now):
        if ways.teams[by] != team and state.states[by] != TAGGED:
            at = first_exposed(ways.near(name, by, layout.tag_distance), exposed, one, two)
            if at < math.inf:
                found[by] = at
    return found


# What follows are functions of numbers alone, so that they can be compiled for many matches at once as they stand.


def inside(start: Vector, end: Vector, centre: Vector, radius: float) -> Stretch:
    """The stretch in which a player on its way was within `radius` m of a place."""
    return disc_part(start, end, centre, radius + ROUNDING)


def near(a0: Vector, a1: Vector, b0: Vector, b1: Vector, reach: float) -> Stretch:
    """The stretch in which two players, on their ways from a0 to a1 and from b0 to b1, were within `reach` m."""
    return inside((a0[0] - b0[0], a0[1] - b0[1]), (a1[0] - b1[0], a1[1] - b1[1]), (0.0, 0.0), reach)


def first_exposed(reach: Stretch, exposed: Stretch, one: Stretch, two: Stretch) -> float:
    """The first instant in both stretches that is in none of two refuges; infinite if there is none.

    A refuge holds its ends: a player is out of it only after its end.
    """
    at, last = max(reach[0], exposed[0]), min(reach[1], exposed[1])
    if at > last:
        return math.inf
    for start, end in (one, two) if one <= two else (two, one):
        if start - ROUNDING <= at <= end:
            if end >= last - ROUNDING:
                return math.inf
            at = end
    return at


def invasion(start: float, end: float, midline: float, ahead: float) -> Stretch:
    """The stretch in which a player was on the opponents' side of the midline, or on it.

    What is beyond the other borders of the field counts too, so that no player is safe because it leaves the field.

    Args:
        start, end: the x at which it was and is, m. midline: its x, m. ahead: 1 if the opponents' half is at greater x;
            -1 if it is at smaller x.
    """
    was, now = (start - midline) * ahead >= 0.0, (end - midline) * ahead >= 0.0
    if was and now:
        return 0.0, 1.0
    if not (was or now):
        return NEVER
    crossing = (midline - start) / (end - start)
    return (crossing, 1.0) if now else (0.0, crossing)
