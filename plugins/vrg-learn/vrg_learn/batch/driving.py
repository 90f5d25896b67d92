"""Driving for players of a batch that play by a strategy: past bodies, and away from those that tag."""

import math

import numpy as np

from vrg.agents.interception import earliest
from vrg.games.roboflag.evasion import DIRECTIONS, DISTANCES, EVEN, LEVEL, NEARER, SAFER, TURN_COSTS, UNITS
from vrg.navigation.avoidance import WAYS
from vrg.navigation.control import linearise
from vrg.navigation.pilot import CLEARANCE, HORIZON, OFFSET, TIGHT
from vrg.portable.scalars import hypot
from vrg.types import Vector
from vrg_learn.batch.records import Flags, Floats

Box = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max, m."""


def head(
    n: int,
    pose: tuple[float, float, float],
    wanted: Vector,
    ignored: Flags,
    poses: Floats,
    velocities: Floats,
    radii: Floats,
    box: Box,
    offset: float = OFFSET,
) -> tuple[float, float]:
    """The twist (v, w) with which a robot drives past the bodies that are near, as `vrg.navigation.pilot` does.

    Args:
        n: its row. pose: its own. wanted: the wanted velocity, m/s. ignored: who may be touched.
        poses, velocities: of all, shape (players, 3) and (players, 2), m and m/s. radii: of all, m.
        box: where the centre of its body should be. offset: to the point that is steered, m.
    """
    x, y, theta = pose
    u = steer(n, x, y, wanted, ignored, poses, velocities, radii, 1.0, CLEARANCE / 2, HORIZON, box)
    if u[0] == 0.0 and u[1] == 0.0:
        u = steer(n, x, y, wanted, ignored, poses, velocities, radii, TIGHT, 0.0, HORIZON, box)
    twist = linearise(u, theta, offset)
    return twist.v, twist.w


def steer(
    n: int,
    x: float,
    y: float,
    wanted: Vector,
    ignored: Flags,
    poses: Floats,
    velocities: Floats,
    radii: Floats,
    factor: float,
    gap: float,
    horizon: float,
    box: Box,
) -> Vector:
    """The velocity nearest to the wanted one that stays clear of bodies, as `vrg.navigation.avoidance.steer` finds it.

    Args:
        factor, gap: how much of the radii counts, and the distance to keep besides, m.
        horizon: how far ahead it looks, s.
    """
    speed = hypot(wanted[0], wanted[1])
    if speed < 1e-6:
        return 0.0, 0.0
    for cos, sin in WAYS:
        ux, uy = wanted[0] * cos - wanted[1] * sin, wanted[0] * sin + wanted[1] * cos
        free = outside(x + ux, y + uy, box)
        if free > 0.0 and free >= outside(x, y, box):
            continue
        clear = True
        for other in range(len(poses)):
            if other == n or ignored[other]:
                continue
            keep = (radii[n] + radii[other]) * factor + gap
            px, py = poses[other, 0] - x, poses[other, 1] - y
            vx, vy = velocities[other, 0] - ux, velocities[other, 1] - uy
            closing = -(px * vx + py * vy)
            if closing <= 0.0:
                continue
            time = min(closing / (vx * vx + vy * vy), horizon)
            if px * px + py * py < keep * keep or hypot(px + vx * time, py + vy * time) < keep:
                clear = False
                break
        if clear:
            return ux, uy
    return 0.0, 0.0


def meeting_time(dx: float, dy: float, speed: float, vx: float, vy: float, reach: float) -> float:
    """The time in s after which one that drives straight meets a target, as `vrg.agents.interception.intercept` finds.

    It is infinite if they never meet.

    Args:
        dx, dy: the way to the target, m. speed: m/s. vx, vy: the target's velocity, m/s.
        reach: the distance that counts as met, m.
    """
    if hypot(dx, dy) - reach < 1e-9:
        return 0.0
    a, b = vx * vx + vy * vy - speed * speed, 2.0 * (dx * vx + dy * vy - reach * speed)
    return earliest(a, b, dx * dx + dy * dy - reach * reach)


def scaled(u: Vector, length: float) -> Vector:
    """The vector u, scaled to a length; the zero vector stays zero."""
    own = hypot(u[0], u[1])
    return (u[0] * length / own, u[1] * length / own) if own >= 1e-9 else (0.0, 0.0)


def nearest_in(x: float, y: float, box: Box) -> Vector:
    """The place in a box that is nearest to another one, m."""
    return min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])


def within(bounds: Floats, margin: float) -> Box:
    """The part of a field that is at least so far from its border, m."""
    return bounds[0] + margin, bounds[1] + margin, bounds[2] - margin, bounds[3] - margin


def outside(x: float, y: float, box: Box) -> float:
    """The distance of a place from a box, m; 0 inside it."""
    return hypot(max(box[0] - x, 0.0, x - box[2]), max(box[1] - y, 0.0, y - box[3]))


def safest(
    place: Vector,
    goal: Vector,
    hunters: Floats,
    speed: float,
    reach: float,
    margin: float,
    box: Box,
    discs: Floats,
    midline: float,
    ahead: float,
) -> tuple[float, float, float, float]:
    """The direction (a unit vector), the progress and the margin of `vrg.games.roboflag.evasion.best_course`.

    Args:
        hunters: shape (hunters, 2), m. discs: where nobody is tagged, shape (discs, 3): x, y and radius, m.
        midline, ahead: nobody is tagged on the side of this x that is not in the direction of `ahead`, 1 or -1;
            with 0 there is no such side.
    """
    (x, y), (goal_x, goal_y) = place, goal
    far = hypot(goal_x - x, goal_y - y)
    straight = ((goal_x - x) / far, (goal_y - y) / far) if far > 0.0 else (1.0, 0.0)
    longest = max(far, DISTANCES[0])
    best, best_worth, best_value, best_margin = straight, -math.inf, 0.0, 0.0
    other, other_worth, other_margin = straight, -math.inf, 0.0
    for number in range(DIRECTIONS):
        cos = UNITS[number, 0] * straight[0] - UNITS[number, 1] * straight[1]
        sin = UNITS[number, 1] * straight[0] + UNITS[number, 0] * straight[1]
        level, first, value = LEVEL, 0.0, -math.inf
        for step in range(len(DISTANCES)):
            way = min(DISTANCES[step], longest)
            px, py = x + cos * way, y + sin * way
            level = min(level, spare(px, py, way, hunters, speed, reach, box, discs, midline, ahead))
            progress = far - hypot(px - goal_x, py - goal_y)
            if step == 0:
                first = level
            elif step == 1 and np.rint((level + NEARER * progress) * EVEN) > other_worth:
                other, other_margin = (cos, sin), first
                other_worth = np.rint((level + NEARER * progress) * EVEN)
            if level >= margin:
                value = max(value, progress + SAFER * level)
            elif step > 0:
                break
        worth = np.rint((value - TURN_COSTS[number]) * EVEN)
        if worth > best_worth:
            best, best_worth, best_value, best_margin = (cos, sin), worth, value, first
    if best_worth > -math.inf:
        return best[0], best[1], best_value, best_margin
    return other[0], other[1], 0.0, other_margin


def spare(
    x: float,
    y: float,
    way: float,
    hunters: Floats,
    speed: float,
    reach: float,
    box: Box,
    discs: Floats,
    midline: float,
    ahead: float,
) -> float:
    """The time in s by which a player is at a place, after `way` m, before the first hunter can tag it there."""
    if outside(x, y, box) > 0.0:
        return -LEVEL
    if (x - midline) * ahead < 0.0:
        return LEVEL
    for disc in range(len(discs)):
        dx, dy = x - discs[disc, 0], y - discs[disc, 1]
        if dx * dx + dy * dy < discs[disc, 2] * discs[disc, 2]:
            return LEVEL
    nearest = math.inf
    for hunter in range(len(hunters)):
        dx, dy = hunters[hunter, 0] - x, hunters[hunter, 1] - y
        nearest = min(nearest, dx * dx + dy * dy)
    return min(LEVEL, (max(0.0, math.sqrt(nearest) - reach) - way) / speed)
