"""Keeping clear of bodies and borders: the nearest free direction to the one that is wanted."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vrg.regions import Region
from vrg.types import Vector

TURNS = (0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9, 1.25, -1.25, 1.6, -1.6, 2.1, -2.1, 2.6, -2.6, math.pi)
"""Directions that are tried, in this order, as turns from the wanted one (rad)."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A body in the way.

    Args:
        position: m. velocity: m/s. clearance: m to keep between the centres.
    """

    position: Vector
    velocity: Vector
    clearance: float


def steer(position: Vector, wanted: Vector, obstacles: Sequence[Obstacle], bounds: Region, horizon: float) -> Vector:
    """The velocity, as fast as the wanted one, that stays clear for `horizon` s and deviates least.

    A body that is already too near may be moved away from, never closer to. Where no direction is clear, the result is
    the zero vector.

    Args:
        wanted: m/s.
        bounds: where the body's centre may be; from outside, only ways back in are clear.
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
    """One second ahead: inside, or nearer to the inside than now."""
    ahead = position[0] + u[0], position[1] + u[1]
    if bounds.contains(*ahead):
        return True
    return math.dist(ahead, bounds.nearest(*ahead)) < math.dist(position, bounds.nearest(*position))


def _clear(position: Vector, u: Vector, obstacle: Obstacle, horizon: float) -> bool:
    """Whether the closest approach within the horizon keeps the clearance."""
    px, py = obstacle.position[0] - position[0], obstacle.position[1] - position[1]
    vx, vy = obstacle.velocity[0] - u[0], obstacle.velocity[1] - u[1]
    closing = -(px * vx + py * vy)
    if closing <= 0:
        return True
    if px * px + py * py < obstacle.clearance**2:
        return False
    time = min(closing / (vx * vx + vy * vy), horizon)
    return math.hypot(px + vx * time, py + vy * time) >= obstacle.clearance
