"""The decisions at a look, as functions of numbers: those of lists judge one match, and those of arrays many at once.

A record is an object with these fields, each a sequence of one value for each player unless something else is said:

- the setting: `bounds` of the field and `zones` of the low and the high end, (x_min, y_min, x_max, y_max) in m;
  `tag_distance`, m; `pass_limit`, s, 0 for none; and `order`, the rows of the players in the order of their names;
- the standing: `roles`; `active`; `points` of the minnows and the sharks; `seen`, at how many of the two looks (one is
  that of now); `goal`, the end that minnows cross to. `judge` changes who is active, and the points. In `outs`,
  `exits`, `instants`, `hunters` and `boxes` it works.

Calls are noted as vrg.coordinator.look has them, by the numbers of RULES. Poses are (x, y, heading).
"""

import math
from collections.abc import Sequence
from typing import Any, Final

from vrg.coordinator.look import NO_ONE, note
from vrg.games.sharks_and_minnows.tagging import RESOLUTION, SweptBody, first_tag, swept
from vrg.geometry import circumradius, interpolate, outline_distance
from vrg.portable.scalars import hypot
from vrg.regions import Bounds
from vrg.segments import in_box
from vrg.types import Pose

MINNOW, SHARK = 0, 1
"""The roles."""
RULES: Final = ("tag", "out_of_bounds", "pass_limit", "pass_over", "new_shark")
TAGGED, OUT_OF_BOUNDS, LATE, PASS_OVER, NEW_SHARK = range(len(RULES))
"""The rules of calls by their numbers. The first three are why players are out."""
STAYS: Final = -1
"""Stands for the reason why a player is out where it is not."""
NO_ROLE: Final = -1
BOTH = 2
_EPS = 1e-9

Poses = Sequence[Sequence[float]]
"""The pose of each player, or an array of shape (players, 3)."""


def judge(s: Any, t: Any, c: Any, before: Poses, now: Poses, sizes: Poses, clock: float) -> bool:
    """Judge a look, and return whether the pass is over: every minnow that is left is in the safe zone.

    Args:
        s, t, c: the setting, the standing, and the record of calls. before, now: where the players are at the looks.
        sizes: the length and the width of each body, m. clock: the time of play in this pass, s.
    """
    over = find_outs(s, t, before, now, sizes, clock)
    for out in (TAGGED, OUT_OF_BOUNDS, LATE):
        for n in s.order:
            if t.outs[n] == out:
                at = t.instants[n] if out == TAGGED else t.exits[n]
                k = note(c, out, n, at)
                if out == TAGGED:
                    for shark in s.order:
                        if tags(s, t, before, now, sizes, shark, n):
                            c.others[k][shark] = True
    for n in s.order:
        if t.outs[n] != STAYS:
            t.active[n] = False
            t.points[SHARK] += t.roles[n] == MINNOW
    if over:
        k = note(c, PASS_OVER, NO_ONE, math.inf)
        for n in s.order:
            if t.active[n] and t.roles[n] == MINNOW:
                c.others[k][n] = True
                t.points[MINNOW] += 1
    return over


def find_outs(s: Any, t: Any, before: Poses, now: Poses, sizes: Poses, clock: float) -> bool:
    """Find who is out at a look and why, and return whether the pass is over."""
    find_exits(s, t, before, now)
    hunters, refuge = find_hunters(s, t, before, now, sizes), box_of(s.zones[t.goal])
    late = s.pass_limit > 0.0 and clock >= s.pass_limit - _EPS
    over, active, roles, seen, outs, exits = True, t.active, t.roles, t.seen, t.outs, t.exits
    for n in s.order:
        outs[n] = OUT_OF_BOUNDS if exits[n] < math.inf else STAYS
        if not active[n] or roles[n] == SHARK:
            continue
        if hunters > 0 and seen[n] == BOTH:
            at = t.instants[n] = tagged_at(s, t, before, now, sizes, hunters, n, refuge)
            if at < math.inf:
                outs[n] = TAGGED
        if outs[n] == STAYS and not (seen[n] > 0 and inside(now[n][0], now[n][1], refuge)):
            if late:
                outs[n] = LATE
            else:
                over = False
    return over


def find_exits(s: Any, t: Any, before: Poses, now: Poses) -> None:
    """Find when each active player left the field."""
    field = box_of(s.bounds)
    x_min, y_min, x_max, y_max = field
    active, seen, exits = t.active, t.seen, t.exits
    for n in s.order:
        exits[n] = math.inf
        if active[n] and seen[n] > 0:
            x, y, was_x, was_y = now[n][0], now[n][1], before[n][0], before[n][1]
            if not (x_min <= was_x <= x_max and y_min <= was_y <= y_max):
                exits[n] = 0.0
            elif not (x_min <= x <= x_max and y_min <= y <= y_max):
                enter, leave = in_box((was_x, was_y), (x, y), field)
                exits[n] = leave if enter <= leave else 0.0


def find_hunters(s: Any, t: Any, before: Poses, now: Poses, sizes: Poses) -> int:
    """List the active sharks with what each may cover, and return how many there are."""
    count = 0
    for n in s.order:
        if t.active[n] and t.roles[n] == SHARK and t.seen[n] == BOTH:
            t.hunters[count] = n
            t.boxes[count] = swept(before[n], now[n], sizes[n], s.tag_distance + RESOLUTION)
            count += 1
    return count


def tagged_at(
    s: Any, t: Any, before: Poses, now: Poses, sizes: Poses, hunters: int, minnow: int, refuge: Bounds
) -> float:
    """The instant at which a minnow is tagged first. It and the shark must still be in bounds."""
    x_min, y_min, x_max, y_max = swept(before[minnow], now[minnow], sizes[minnow], 0.0)
    boxes, best = t.boxes, math.inf
    for k in range(hunters):
        box = boxes[k]
        if box[0] <= x_max and x_min <= box[2] and box[1] <= y_max and y_min <= box[3]:
            n = t.hunters[k]
            at = first_tag(way(before, now, sizes, n), way(before, now, sizes, minnow), s.tag_distance, refuge)
            if at <= min(1.0, t.exits[n], t.exits[minnow]):
                best = min(best, at)
    return best


def tags(s: Any, t: Any, before: Poses, now: Poses, sizes: Poses, n: int, minnow: int) -> bool:
    """True if a player is a shark that is within reach of a minnow at the instant at which that is tagged."""
    at = t.instants[minnow]
    if not (t.active[n] and t.roles[n] == SHARK and t.seen[n] == BOTH and at <= min(t.exits[n], t.exits[minnow])):
        return False
    (h0, h1, own), (p0, p1, size) = way(before, now, sizes, n), way(before, now, sizes, minnow)
    hunter, prey = interpolate(h0, h1, at), interpolate(p0, p1, at)
    if hypot(hunter.x - prey.x, hunter.y - prey.y) > circumradius(own) + circumradius(size) + s.tag_distance + _EPS:
        return False
    return bool(outline_distance(hunter, prey, own, size) <= s.tag_distance)


def way(before: Poses, now: Poses, sizes: Poses, n: int) -> SweptBody:
    """The motion of a body between the looks."""
    a, b, size = before[n], now[n], sizes[n]
    return Pose(a[0], a[1], a[2]), Pose(b[0], b[1], b[2]), (size[0], size[1])


def inside(x: float, y: float, box: Bounds) -> bool:
    """True if a place is in a box or on its border."""
    return box[0] <= x <= box[2] and box[1] <= y <= box[3]


def box_of(bounds: Sequence[float]) -> Bounds:
    """Bounds as a tuple."""
    return bounds[0], bounds[1], bounds[2], bounds[3]


def winner(left: int, number: int, rounds: int) -> int:
    """The role whose team has won after a pass; NO_ROLE if the game goes on.

    Args:
        left: the minnows that are left. number: that of the pass. rounds: of the game.
    """
    if left == 0:
        return SHARK
    return MINNOW if number >= rounds else NO_ROLE
