"""Avoidance of bodies and borders: the free direction that is nearest to the wanted one."""

import math
from collections.abc import Sequence

from msgspec import Struct

from vrg.regions import Region
from vrg.types import Vector

TURNS = (0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9, 1.25, -1.25, 1.6, -1.6, 2.1, -2.1, 2.6, -2.6, math.pi)
"""The directions that are tried, in this order, as turns from the wanted direction in rad."""


class Obstacle(Struct, frozen=True):
    """A body that must be avoided.

    Args:
        position: the body's centre, m. velocity: its velocity, m/s.
        clearance: the distance to keep between the two centres, m.
    """

    position: Vector
    velocity: Vector
    clearance: float


def steer(position: Vector, wanted: Vector, obstacles: Sequence[Obstacle], bounds: Region, horizon: float) -> Vector:
    """Return the velocity nearest to the wanted direction that stays clear of the obstacles for `horizon` s.

    It is as fast as the wanted velocity. It also stays within the bounds for one second. From an obstacle that is
    already too near, it may only lead away. If no direction of TURNS is clear, the result is the zero vector.

    Args:
        position: the centre of the body that moves, m.
        wanted: the wanted velocity, m/s.
        bounds: where the body's centre may be. If it is outside, only directions that lead back are clear.
    """
    speed = math.hypot(*wanted)
    if speed < 1e-6:
        return 0.0, 0.0
    near = [
        o
        for o in obstacles
        if math.dist(position, o.position) < o.clearance + (speed + math.hypot(*o.velocity)) * horizon
    ]
    for turn in TURNS:
        c, s = math.cos(turn), math.sin(turn)
        u = wanted[0] * c - wanted[1] * s, wanted[0] * s + wanted[1] * c
        if _in_bounds(position, u, bounds) and all(_clear(position, u, o, horizon) for o in near):
            return u
    return 0.0, 0.0


def _in_bounds(position: Vector, u: Vector, bounds: Region) -> bool:
    """Whether the body is inside after one second, or nearer to the inside than now."""
    ahead = position[0] + u[0], position[1] + u[1]
    if bounds.contains(*ahead):
        return True
    return math.dist(ahead, bounds.nearest(*ahead)) < math.dist(position, bounds.nearest(*position))


def _clear(position: Vector, u: Vector, obstacle: Obstacle, horizon: float) -> bool:
    """Whether the distance at the closest approach within the horizon is at least the clearance."""
    px, py = obstacle.position[0] - position[0], obstacle.position[1] - position[1]
    vx, vy = obstacle.velocity[0] - u[0], obstacle.velocity[1] - u[1]
    closing = -(px * vx + py * vy)
    if closing <= 0:
        return True
    if px * px + py * py < obstacle.clearance**2:
        return False
    time = min(closing / (vx * vx + vy * vy), horizon)
    return math.hypot(px + vx * time, py + vy * time) >= obstacle.clearance
