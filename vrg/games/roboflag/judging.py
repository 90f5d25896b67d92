"""The judgement of RoboFlag at one look (thesis, Algorithm 4.3): first home, then the flag, then tags.

The whole ways of the players since the look before are judged, so that none jumps over anything. Distances are between
centres, and a player at exactly the distance is near enough.

These are functions of numbers: those of lists judge one match, and those of arrays many at once. A record is an object
with these fields, each a sequence of one value for each player unless something else is said:

- the setting: `sides`, the number of its team; `order`, the rows of the players in the order of their names; of each
  team `flag_places` and `homes`, (x, y) in m, and `ahead`, 1 if its opponents' half is at greater x or -1; `midline`,
  its x in m; `tag_distance`, `flag_reach`, `home_reach` and `zone`, the radius of a flag zone, m; `captures`, those
  that win; and `round_time` and `sudden_death`, how long such rounds last, s;
- the standing: `states`; `here`, whether it is judged; of each team `carriers`, who has its flag, and `points`. `judge`
  changes these. In `after` it works.

Calls are noted as vrg.coordinator.look has them, by the numbers of RULES. Poses are (x, y, heading).
"""

import math
from collections.abc import Sequence
from typing import Any, Final

from vrg.coordinator.look import NO_ONE, note
from vrg.portable.scalars import hypot
from vrg.segments import NEVER, Stretch, disc_part
from vrg.types import Vector

NORMAL, TAGGED, FLAGGED = range(3)
"""The states."""
RULES: Final = ("home", "capture", "flag", "tag", "time", "sudden_death")
HOME, CAPTURE, FLAG, TAG, TIME, SUDDEN = range(len(RULES))
"""The rules of calls by their numbers. The last two are about nobody."""
DRAWN = 2
"""The winner of a draw; of a game that goes on it is NO_ONE, as is the carrier of a flag that is in its place."""
ROUNDS = 2
SUDDEN_DEATH = 3
"""The number of the round that decides a tie."""
ROUNDING = 1e-9
"""The distance in m by which a player may be farther away than a limit, because numbers are rounded; and the fraction
of the time between two looks by which two instants may differ that are the same."""

Poses = Sequence[Sequence[float]]
"""The pose of each player, or an array of shape (players, 3)."""


def judge(s: Any, t: Any, c: Any, before: Poses, now: Poses, number: int, clock: float) -> bool:
    """Judge a look, and return whether the round is over.

    Args:
        s, t, c: the setting, the standing, and the record of calls. before, now: where the players are at the looks.
        number: that of the round. clock: the time of play in it, s.
    """
    captured = judge_homes(s, t, c, before, now)
    judge_flags(s, t, c, before, now)
    judge_tags(s, t, c, before, now)
    decided = is_decided(s, t.points, number, captured)
    if not decided and clock < time_limit(s, number) - 1e-9:
        return False
    if not decided:
        note(c, TIME, NO_ONE, math.inf)
    return True


def judge_homes(s: Any, t: Any, c: Any, before: Poses, now: Poses) -> bool:
    """A player that came in reach of its own home becomes normal; a carrier scores there, and the flag returns.

    Returns:
        whether a flag was captured.
    """
    captured = False
    for n in s.order:
        if not t.here[n] or t.states[n] == NORMAL:
            continue
        team, (start, end) = s.sides[n], way(before, now, n)
        at, last = inside(start, end, (s.homes[team][0], s.homes[team][1]), s.home_reach)
        if at > last:
            continue
        if t.states[n] == FLAGGED:
            captured = True
            t.carriers[1 - team] = NO_ONE
            t.points[team] += 1
        note(c, HOME if t.states[n] == TAGGED else CAPTURE, n, at)
        t.states[n] = NORMAL
    return captured


def judge_flags(s: Any, t: Any, c: Any, before: Poses, now: Poses) -> None:
    """A normal player that came in reach of the opponents' flag takes it.

    Among several it is the first, among those at the same instant the nearest, and then the first by name. A
    flag has one carrier, and a team has one flag to take, so no player carries two.
    """
    for team in range(2):
        if t.carriers[team] != NO_ONE:
            continue
        place = (s.flag_places[team][0], s.flag_places[team][1])
        taker, first, nearest = NO_ONE, math.inf, math.inf
        for n in s.order:
            if not t.here[n] or s.sides[n] == team or t.states[n] != NORMAL:
                continue
            start, end = way(before, now, n)
            at, last = inside(start, end, place, s.flag_reach)
            if at > last:
                continue
            x, y = start[0] + (end[0] - start[0]) * at, start[1] + (end[1] - start[1]) * at
            far = hypot(x - place[0], y - place[1])
            if at < first or (at == first and far < nearest):
                taker, first, nearest = n, at, far
        if taker != NO_ONE:
            t.states[taker], t.carriers[team] = FLAGGED, taker
            note(c, FLAG, taker, first)


def judge_tags(s: Any, t: Any, c: Any, before: Poses, now: Poses) -> None:
    """Judge all tags by the states before any of them, so that two players can tag each other.

    Opponents that are not tagged themselves tag. A normal player can be tagged on the opponents' half, and a carrier
    anywhere; no player can be inside a flag zone. The flag of a tagged carrier returns to its place.
    """
    for n in s.order:
        t.after[n] = t.states[n]
        if not t.here[n] or t.states[n] == TAGGED:
            continue
        team, (start, end) = s.sides[n], way(before, now, n)
        exposed: Stretch = (0.0, 1.0)
        if t.states[n] == NORMAL:
            exposed = invasion(start[0], end[0], s.midline, s.ahead[team])
        if exposed == NEVER:
            continue
        one = inside(start, end, (s.flag_places[0][0], s.flag_places[0][1]), s.zone)
        two = inside(start, end, (s.flag_places[1][0], s.flag_places[1][1]), s.zone)
        k = NO_ONE
        for by in s.order:
            if not t.here[by] or s.sides[by] == team or t.states[by] == TAGGED:
                continue
            b0, b1 = way(before, now, by)
            at = first_exposed(near(start, end, b0, b1, s.tag_distance), exposed, one, two)
            if at < math.inf:
                if k == NO_ONE:
                    k = note(c, TAG, n, at)
                c.others[k][by] = True
                c.instants[k] = min(c.instants[k], at)
        if k != NO_ONE:
            t.after[n] = TAGGED
            if t.states[n] == FLAGGED:
                t.carriers[1 - team] = NO_ONE
    for n in s.order:
        t.states[n] = t.after[n]


def is_decided(s: Any, points: Sequence[int], number: int, captured: bool) -> bool:
    """True if a round ends before its time: by enough captures, or by any in sudden death.

    Args:
        points: of each team; an official may set them. number: that of the round.
        captured: whether a flag was captured at this look: both teams may capture at once, which leaves a tie.
    """
    if number == SUDDEN_DEATH:
        return captured or points[0] != points[1]
    return is_enough(s, points)


def is_enough(s: Any, points: Sequence[int]) -> bool:
    """True if a team has captured enough flags to end the game."""
    return bool(max(points[0], points[1]) >= s.captures)


def time_limit(s: Any, number: int) -> float:
    """The time of play after which a round ends, s."""
    return float(s.sudden_death if number == SUDDEN_DEATH else s.round_time)


def next_number(s: Any, points: Sequence[int], number: int) -> int:
    """The number of the round that follows one, if the game goes on."""
    return SUDDEN_DEATH if number >= ROUNDS or is_enough(s, points) else number + 1


def winner(s: Any, points: Sequence[int], number: int) -> int:
    """The team that has won after a round; DRAWN, or NO_ONE if the game goes on."""
    if next_number(s, points, number) == SUDDEN_DEATH and points[0] != points[1]:
        return 0 if points[0] > points[1] else 1
    return DRAWN if number >= SUDDEN_DEATH else NO_ONE


def way(before: Poses, now: Poses, n: int) -> tuple[Vector, Vector]:
    """Where a player was and is, m."""
    a, b = before[n], now[n]
    return (a[0], a[1]), (b[0], b[1])


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
