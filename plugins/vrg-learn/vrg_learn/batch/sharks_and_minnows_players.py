"""The shipped strategy of Sharks and Minnows for many matches at once, as an opponent or a teacher of those who learn.

It decides as vrg.games.sharks_and_minnows.player does, by its numbers, from the poses that the referee has published;
unlike there, a shark knows how fast the referee lets it be.
"""

import math
from typing import Final

import numpy as np

from vrg.agents.potential import SHARK_WEIGHT
from vrg.coordinator.look import NO_ONE
from vrg.games.sharks_and_minnows.judging import MINNOW, SHARK
from vrg.games.sharks_and_minnows.player import (
    CALM_DISTANCE,
    EVADE_DISTANCE,
    MARK_REACH,
    SHARK_OFFSET,
)
from vrg.games.sharks_and_minnows.scene import ASSUMED_SPEED, BORDER_CLEARANCE, UNMET, URGENCY
from vrg.navigation.pilot import OFFSET
from vrg.portable.scalars import hypot
from vrg.types import Vector
from vrg_learn.batch.driving import Box, head, meeting_time, nearest_in, outside, scaled, within
from vrg_learn.batch.records import Record

CROSS, EVADE = 0, 1
"""The modes of a minnow."""
STRATEGIES: Final = ("sharks-and-minnows",)
"""The strategies by their numbers."""
STEP, LOOK = 0.5, 3.0
"""How far ahead an evading minnow looks for the border, and for room beside a shark, m."""


def forget(p: Record) -> None:
    """Forget all of the round before."""
    p.job[:] = CROSS
    p.target[:] = NO_ONE


def plan(s: Record, t: Record, r: Record, k: Record, p: Record, now: float) -> None:
    """Give each minnow its berth in the safe zone, and each shark the minnow that it chases.

    Args:
        p: the plans of the match: see `vrg_learn.batch.stepping.plans`.
    """
    count, zone = len(s.sides), s.zones[t.goal]
    along_y = zone[2] - zone[0] >= s.bounds[2] - s.bounds[0]
    minnows = 0
    for n in range(count):
        minnows += t.active[n] and t.roles[n] == MINNOW
    for n in s.order:
        if not (t.active[n] and t.roles[n] == MINNOW):
            continue
        rank, across = 0, k.poses[n, 0] if along_y else k.poses[n, 1]
        for o in s.order:
            if t.active[o] and t.roles[o] == MINNOW:
                rank += (k.poses[o, 0] if along_y else k.poses[o, 1]) < across
        p.place[n, 0], p.place[n, 1] = s.berths[t.goal, minnows, rank, 0], s.berths[t.goal, minnows, rank, 1]
        near, gap = nearest_shark(t, k, n)
        p.target[n] = near
        if gap < EVADE_DISTANCE or gap > CALM_DISTANCE:
            p.job[n] = EVADE if gap < EVADE_DISTANCE else CROSS
    chase(s, t, r, k, p)


def nearest_shark(t: Record, k: Record, n: int) -> tuple[int, float]:
    """The active shark that is nearest to a player, and its distance, m."""
    found, least = NO_ONE, math.inf
    for o in range(len(t.roles)):
        if o != n and t.active[o] and t.roles[o] == SHARK:
            gap = hypot(k.poses[o, 0] - k.own[n, 0], k.poses[o, 1] - k.own[n, 1])
            if gap < least:
                found, least = o, gap
    return found, least


def chase(s: Record, t: Record, r: Record, k: Record, p: Record) -> None:
    """Share the minnows out: the pairs that cost least come first, and two share one only if too few are left."""
    count = len(s.sides)
    costs = np.full((count, count), math.inf)
    free = np.ones(count, dtype=np.bool_)
    for n in range(count):
        if not (t.active[n] and t.roles[n] == SHARK):
            continue
        p.target[n] = NO_ONE
        for o in range(count):
            if is_prey(s, t, k, o):
                costs[n, o] = cost(s, t, r, k, n, o)
    for sharing in range(2):
        while True:
            shark, prey, least = NO_ONE, NO_ONE, math.inf
            for n in s.order:
                if t.active[n] and t.roles[n] == SHARK and p.target[n] == NO_ONE:
                    for o in range(count):
                        if costs[n, o] < least and (sharing or free[o]):
                            shark, prey, least = n, o, costs[n, o]
            if shark == NO_ONE:
                break
            p.target[shark], free[prey] = prey, False


def is_prey(s: Record, t: Record, k: Record, n: int) -> bool:
    """True for an active minnow outside the safe zone."""
    return bool(t.active[n] and t.roles[n] == MINNOW and not is_safe(s, t, k.poses[n, 0], k.poses[n, 1]))


def is_safe(s: Record, t: Record, x: float, y: float) -> bool:
    """True if a place, m, is in the zone that minnows cross to."""
    zone = s.zones[t.goal]
    return bool(zone[0] <= x <= zone[2] and zone[1] <= y <= zone[3])


def cost(s: Record, t: Record, r: Record, k: Record, shark: int, minnow: int) -> float:
    """The cost of a chase, s: the time to meet the minnow, and more the farther that is from the safe zone."""
    x, y, vx, vy = k.poses[minnow, 0], k.poses[minnow, 1], k.velocities[minnow, 0], k.velocities[minnow, 1]
    dx, dy = x - k.poses[shark, 0], y - k.poses[shark, 1]
    zone = s.zones[t.goal]
    safe = (zone[0], zone[1], zone[2], zone[3])
    urgency = URGENCY * outside(x, y, safe)
    time = meeting_time(dx, dy, ASSUMED_SPEED, vx, vy, r.reach[shark] + r.reach[minnow])
    if time == math.inf or outside(x + vx * time, y + vy * time, safe) == 0.0:
        return UNMET + hypot(dx, dy) + urgency
    return time + urgency


def decide(s: Record, t: Record, r: Record, k: Record, p: Record, n: int, now: float) -> tuple[float, float]:
    """The twist (v, w) of a player, after `plan`."""
    p.ignored[:] = False
    if not t.active[n]:
        return 0.0, 0.0
    x, y = k.own[n, 0], k.own[n, 1]
    box = within(s.bounds, BORDER_CLEARANCE)
    if t.roles[n] == SHARK:
        return hunt(s, t, r, k, p, n, box)
    zone, start = s.zones[t.goal], s.zones[1 - t.goal]
    way = (p.place[n, 0] - x, p.place[n, 1] - y)
    if is_safe(s, t, x, y):
        far = hypot(way[0], way[1])
        if far < MARK_REACH:
            return 0.0, 0.0
        speed = min(r.v_max[n], max(0.15, far))
        return towards(r, k, p, n, scaled(way, speed), OFFSET, box)
    if p.job[n] == EVADE and p.target[n] != NO_ONE:
        shark = p.target[n]
        p.ignored[shark] = True
        safe = (zone[0], zone[1], zone[2], zone[3])
        wanted = evade(
            (x, y), (k.poses[shark, 0], k.poses[shark, 1]), safe, box, (start[0], start[1], start[2], start[3])
        )
    else:
        wanted = descent(t, k, n, (x, y), way)
    return towards(r, k, p, n, scaled(wanted, r.v_max[n]), OFFSET, box)


def descent(t: Record, k: Record, n: int, here: Vector, way: Vector) -> Vector:
    """The direction in which the potential of a minnow falls: see `vrg.agents.potential.descent`."""
    x, y, sharks = 0.0, 0.0, 0
    for o in range(len(t.roles)):
        if o != n and t.active[o] and t.roles[o] == SHARK:
            x, y, sharks = x + k.poses[o, 0], y + k.poses[o, 1], sharks + 1
    ux, uy = scaled(way, 1.0)
    if sharks > 0:
        ax, ay = scaled((here[0] - x / sharks, here[1] - y / sharks), SHARK_WEIGHT)
        ux, uy = ux + ax, uy + ay
    return ux, uy


def evade(here: Vector, shark: Vector, safe: Box, box: Box, start: Box) -> Vector:
    """The direction away from a shark, or past it: see `vrg.agents.potential.evade`."""
    away = scaled((here[0] - shark[0], here[1] - shark[1]), 1.0)
    x, y = nearest_in(here[0] + STEP * away[0], here[1] + STEP * away[1], box)
    moved = (x - here[0], y - here[1])
    if hypot(moved[0], moved[1]) > STEP / 2 and outside(x, y, start) > 0.0:
        return scaled(moved, 1.0)
    target = nearest_in(here[0], here[1], safe)
    goal = scaled((target[0] - here[0], target[1] - here[1]), 1.0)
    best, most = away, -math.inf
    for turn in (1.0, -1.0):
        side = (-turn * away[1], turn * away[0])
        end = nearest_in(here[0] + LOOK * side[0], here[1] + LOOK * side[1], box)
        room = hypot(end[0] - here[0], end[1] - here[1]) + side[0] * goal[0] + side[1] * goal[1]
        if room > most:
            best, most = side, room
    return best


def hunt(s: Record, t: Record, r: Record, k: Record, p: Record, n: int, box: Box) -> tuple[float, float]:
    """The twist of a shark that drives to where its minnow will be met, as fast as it can still stop for it."""
    prey = p.target[n]
    if prey == NO_ONE:
        return 0.0, 0.0
    for o in range(len(s.sides)):
        p.ignored[o] = is_prey(s, t, k, o)
    x, y = k.own[n, 0], k.own[n, 1]
    dx, dy = k.poses[prey, 0] - x, k.poses[prey, 1] - y
    vx, vy, reach = k.velocities[prey, 0], k.velocities[prey, 1], r.reach[n] + r.reach[prey]
    time = meeting_time(dx, dy, t.limits[n], vx, vy, reach)
    time = time if time < math.inf else 0.0
    goal_x, goal_y = nearest_in(k.poses[prey, 0] + vx * time, k.poses[prey, 1] + vy * time, box)
    acceleration = r.slew[n] / r.fastest[n]
    between = max(0.0, hypot(dx, dy) - reach)
    speed = min(r.v_max[n], math.sqrt(2.0 * acceleration * between + vx * vx + vy * vy))
    return towards(r, k, p, n, scaled((goal_x - x, goal_y - y), speed), SHARK_OFFSET, box)


def towards(r: Record, k: Record, p: Record, n: int, wanted: Vector, offset: float, box: Box) -> tuple[float, float]:
    """The twist for a wanted velocity, m/s, which leads around bodies and stays inside the field."""
    pose = (k.own[n, 0], k.own[n, 1], k.own[n, 2])
    return head(n, pose, wanted, p.ignored, k.poses, k.velocities, r.reach, box, offset)
