"""The separation of robots that overlap with walls or with one another, for the planar engine and for batches.

These are functions of numbers: those of lists separate the robots of one world, and those of arrays those of many at
once. A record is an object with these fields, each a sequence of one value for each robot:

- the robots: `sizes`, length and width in m; `grip`, the force of locked wheels, N; `rates`, as in `Drivetrain.rates`;
  `kinematic`, whether nothing pushes it;
- their motion: `poses` and `before` a step, (x, y, heading) in m and rad; `velocities`, v in m/s, w in rad/s, and the
  speed to the left in m/s; `speeds` of the axes, rad/s; `braking`, whether its wheels are locked. What is pushed has
  other poses, velocities and speeds then, and is `moved`. In `shifts`, `shifted`, `blocked`, `stuck` and `back` they
  work.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from vrg.hal.sim.engines.engine import DRIVE
from vrg.hal.sim.shapes import Box, Gap, Outline, apart, box_gap, circle_gap
from vrg.portable.scalars import cos_sin, hypot
from vrg.regions import Circle

SLACK = 1e-9
"""The distance in m that is left between bodies that were pushed apart, so that rounding makes no overlap."""
PUSH_ROUNDS = 6
"""The number of attempts to push bodies apart, before those that still overlap are put back where they came from."""

Pairs = Sequence[Sequence[int]] | npt.NDArray[np.int64]
"""Rows of robots, each with that of another robot, or with the number of a wall; or an array of shape (pairs, 2)."""


class Walls(NamedTuple):
    """The walls and obstacles of a map, which are numbered in this order, as lists or as arrays.

    Args:
        boxes: x, y, heading, length and width of each, in m and rad. turns: the cosine and the sine of each heading.
        circles: x, y and radius of each, m.
    """

    boxes: Any
    turns: Any
    circles: Any


def separate(
    m: Any, r: Any, walls: Walls, at_walls: Pairs, pairs: Pairs, free: Pairs, dt: float, longest: float
) -> bool:
    """Push overlapping bodies apart, put back those that overlap anyway, and return whether any was moved.

    Args:
        m, r: the motion, and the robots. at_walls, pairs: which robots may overlap with which wall or robot.
        free: those of `pairs` in which nobody is kinematic. They are resolved last with the walls, so that a body that
            is caught overlaps with the kinematic one.
        dt: the step, s. longest: the longest push of a robot in one attempt, m.
    """
    for n in range(len(m.poses)):
        m.moved[n] = False
    clear = push_apart(m, r, walls, at_walls, pairs, longest)
    if len(free) < len(pairs):
        clear = push_apart(m, r, walls, at_walls, free, longest)
    if not clear:
        put_back(m, r, walls, at_walls, free)
    any_moved = False
    for n in range(len(m.poses)):
        if m.moved[n]:
            any_moved = True
            slide(m, r, n, dt)
    return any_moved


def push_apart(m: Any, r: Any, walls: Walls, at_walls: Pairs, pairs: Pairs, longest: float) -> bool:
    """Move overlapping bodies out of each other along the shortest way.

    All pushes of an attempt are computed before any is applied, so that the order of the robots does not matter.

    Returns:
        whether none of them overlaps any more, as far as that was seen.
    """
    count = len(m.poses)
    for n in range(count):
        m.blocked[n] = False  # by a wall, or by a body that a wall blocks
    for _ in range(PUSH_ROUNDS):
        for n in range(count):
            m.shifts[n][0], m.shifts[n][1], m.shifted[n] = 0.0, 0.0, False
        for k in range(len(at_walls)):
            n, wall = at_walls[k][0], at_walls[k][1]
            if overlaps(m, r, walls, n, wall):
                shift(m, n, wall_gap(m, r, walls, n, wall), 1.0)
        for n in range(count):
            m.blocked[n] = m.blocked[n] or m.shifted[n]
        for k in range(len(pairs)):
            n, other = pairs[k][0], pairs[k][1]
            if not apart(line(m, r, n), line(m, r, other), 0.0):
                gap = box_gap(body(m, r, n), body(m, r, other))
                share = share_of(m, r, n, other, gap)
                shift(m, n, gap, share)
                shift(m, other, gap, share - 1.0)
        over = True
        for n in range(count):
            if m.shifted[n]:
                dx, dy = m.shifts[n][0], m.shifts[n][1]
                length = hypot(dx, dy)
                shorter = longest / length if length > longest else 1.0
                m.poses[n][0] += dx * shorter
                m.poses[n][1] += dy * shorter
                m.moved[n], over = True, False
        if over:
            return True
    return False


def put_back(m: Any, r: Any, walls: Walls, at_walls: Pairs, pairs: Pairs) -> None:
    """Put bodies that still overlap back where they came from, where none of them overlapped."""
    count, fresh = len(m.poses), True
    for n in range(count):
        m.back[n] = False
    while fresh:
        fresh = False
        for n in range(count):
            m.stuck[n] = False
        for k in range(len(at_walls)):
            n, wall = at_walls[k][0], at_walls[k][1]
            m.stuck[n] = m.stuck[n] or overlaps(m, r, walls, n, wall)
        for k in range(len(pairs)):
            n, other = pairs[k][0], pairs[k][1]
            if not apart(line(m, r, n), line(m, r, other), 0.0):
                m.stuck[n], m.stuck[other] = True, True
        for n in range(count):
            if m.stuck[n] and not m.back[n]:
                for axis in range(3):
                    m.poses[n][axis] = m.before[n][axis]
                m.back[n], m.moved[n], fresh = True, True, True


def line(m: Any, r: Any, n: int) -> Outline:
    """The outline of a body."""
    cos, sin = cos_sin(m.poses[n][2])
    return m.poses[n][0], m.poses[n][1], cos, sin, r.sizes[n][0] / 2, r.sizes[n][1] / 2


def body(m: Any, r: Any, n: int) -> Box:
    """The footprint of a body."""
    return Box(m.poses[n][0], m.poses[n][1], m.poses[n][2], r.sizes[n][0], r.sizes[n][1])


def overlaps(m: Any, r: Any, walls: Walls, n: int, wall: int) -> bool:
    """True if a body overlaps with a wall."""
    if wall >= len(walls.boxes):
        return bool(wall_gap(m, r, walls, n, wall).distance < 0.0)
    x, y, _, length, width = walls.boxes[wall]
    cos, sin = walls.turns[wall]
    return not apart(line(m, r, n), (x, y, cos, sin, length / 2, width / 2), 0.0)


def wall_gap(m: Any, r: Any, walls: Walls, n: int, wall: int) -> Gap:
    """The gap between a body and a wall."""
    if wall < len(walls.boxes):
        x, y, heading, length, width = walls.boxes[wall]
        return box_gap(body(m, r, n), Box(x, y, heading, length, width))
    x, y, radius = walls.circles[wall - len(walls.boxes)]
    return circle_gap(body(m, r, n), Circle(x, y, radius))


def share_of(m: Any, r: Any, n: int, other: int, gap: Gap) -> float:
    """The fraction of a push that the first of two robots takes, 0 to 1.

    A blocked robot holds against one that is not, and blocks it.
    """
    if r.kinematic[n] or r.kinematic[other]:
        return 0.0 if r.kinematic[n] else 1.0
    if m.blocked[n] != m.blocked[other]:
        share = 1.0 if m.blocked[other] else 0.0
        m.blocked[n], m.blocked[other] = True, True
        return share
    own, its = force(m, r, n, gap, 1.0), force(m, r, other, gap, -1.0)
    if own == its:
        return 0.5
    return 1.0 if own < its else 0.0


def force(m: Any, r: Any, n: int, gap: Gap, side: float) -> float:
    """The force in N with which a robot drives at another one or holds against it.

    Args:
        side: 1 if the normal of the gap points to this robot, -1 if it points to the other.
    """
    if m.braking[n]:
        return float(r.grip[n])
    x, y, theta = m.poses[n]
    v, w, aside = m.velocities[n]
    cos, sin = cos_sin(theta)
    vx, vy = v * cos - aside * sin - w * (gap.y - y), v * sin + aside * cos + w * (gap.x - x)
    drives = side * (vx * gap.nx + vy * gap.ny) < -SLACK
    return float(r.grip[n] * DRIVE if drives else r.grip[n])


def shift(m: Any, n: int, gap: Gap, share: float) -> None:
    """Add a share of the push that separates a body from another shape, if they overlap."""
    if share != 0.0 and gap.distance < 0.0:
        push = (SLACK - gap.distance) * share
        m.shifts[n][0] += push * gap.nx
        m.shifts[n][1] += push * gap.ny
        m.shifted[n] = True


def slide(m: Any, r: Any, n: int, dt: float) -> None:
    """Set a robot's velocity to what is left of it after a push, and the speeds of its axes to match."""
    x, y = m.poses[n][0] - m.before[n][0], m.poses[n][1] - m.before[n][1]
    w, theta = (m.poses[n][2] - m.before[n][2]) / dt, m.poses[n][2]
    cos, sin = cos_sin(theta)
    v = slowed((x * cos + y * sin) / dt, m.velocities[n][0])
    side = slowed((y * cos - x * sin) / dt, m.velocities[n][2])
    m.velocities[n][0], m.velocities[n][1], m.velocities[n][2] = v, w, side
    for axis in range(len(r.rates[n])):
        ahead, turn, across = r.rates[n][axis]
        m.speeds[n][axis] = ahead * v + turn * w + across * side


def slowed(speed: float, driven: float) -> float:
    """A speed after a push: it may slow a body down or stop it, but never drives its wheels."""
    return max(0.0, min(speed, driven)) if driven > 0 else min(0.0, max(speed, driven))
