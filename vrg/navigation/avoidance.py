"""Avoidance of bodies and borders: the free direction that is nearest to the wanted one."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Container, Iterable, Sequence
from typing import Final, Protocol

from msgspec import Struct

from vrg.portable.scalars import cos_sin, square
from vrg.types import Vector

TURNS = (0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9, 1.25, -1.25, 1.6, -1.6, 2.1, -2.1, 2.6, -2.6, math.pi)
"""The directions that are tried, in this order, as turns from the wanted direction in rad."""
WAYS: Final = tuple(cos_sin(turn) for turn in TURNS)
"""The cosine and the sine of each turn."""


class FreeArea(Protocol):
    """An area in which a body's centre may be. Every region of `vrg.regions` is one."""

    def contains(self, x: float, y: float) -> bool:
        """True if it may be at (x, y), m."""

    def nearest(self, x: float, y: float) -> Vector:
        """The nearest place to (x, y) where it may be, m."""


class Obstacle(Struct, frozen=True, gc=False):
    """A body that must be avoided.

    Args:
        position: the body's centre, m. velocity: its velocity, m/s.
        clearance: the distance to keep between the two centres, m.
    """

    position: Vector
    velocity: Vector
    clearance: float


class CrowdBody(Struct, frozen=True, gc=False):
    """One of the bodies of a crowd.

    Args:
        position: the body's centre, m. velocity: its velocity, m/s. radius: the radius of the circle around it, m.
    """

    name: str
    position: Vector
    velocity: Vector
    radius: float


class Crowd:
    """Many bodies, put in order once, so that each of them finds those near it without looking at all of them."""

    def __init__(self, bodies: Iterable[CrowdBody]) -> None:
        self._bodies = sorted(bodies, key=lambda body: body.position)
        self._xs = [body.position[0] for body in self._bodies]

    def around(self, position: Vector, radius: float, reach: float, without: Container[str]) -> list[Obstacle]:
        """The bodies that are near one of them, as obstacles whose clearance is that of two circles that touch.

        Args:
            position: the centre of the body that moves, m. radius: its radius, m.
            reach: the distance along x and along y within which bodies are near, m.
            without: the names of bodies that are no obstacles, such as its own.
        """
        first, last = bisect_right(self._xs, position[0] - reach), bisect_left(self._xs, position[0] + reach)
        return [
            Obstacle(body.position, body.velocity, radius + body.radius)
            for body in self._bodies[first:last]
            if abs(body.position[1] - position[1]) < reach and body.name not in without
        ]


def steer(position: Vector, wanted: Vector, obstacles: Sequence[Obstacle], bounds: FreeArea, horizon: float) -> Vector:
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
    near = [o for o in obstacles if is_near(position, speed, o, o.clearance, horizon)]
    for c, s in WAYS:
        u = wanted[0] * c - wanted[1] * s, wanted[0] * s + wanted[1] * c
        if _in_bounds(position, u, bounds) and all(_clear(position, u, o, horizon) for o in near):
            return u
    return 0.0, 0.0


def is_near(position: Vector, speed: float, obstacle: Obstacle, clearance: float, horizon: float) -> bool:
    """True if a body at a position (m) with a speed (m/s) may come nearer than the clearance (m) within `horizon` s."""
    return math.dist(position, obstacle.position) < clearance + (speed + math.hypot(*obstacle.velocity)) * horizon


def _in_bounds(position: Vector, u: Vector, bounds: FreeArea) -> bool:
    """True if the body is inside after one second, or nearer to the inside than now."""
    ahead = position[0] + u[0], position[1] + u[1]
    if bounds.contains(*ahead):
        return True
    return math.dist(ahead, bounds.nearest(*ahead)) < math.dist(position, bounds.nearest(*position))


def _clear(position: Vector, u: Vector, obstacle: Obstacle, horizon: float) -> bool:
    """True if the distance at the closest approach within the horizon is at least the clearance."""
    px, py = obstacle.position[0] - position[0], obstacle.position[1] - position[1]
    vx, vy = obstacle.velocity[0] - u[0], obstacle.velocity[1] - u[1]
    closing = -(px * vx + py * vy)
    if closing <= 0:
        return True
    if px * px + py * py < square(obstacle.clearance):
        return False
    time = min(closing / (vx * vx + vy * vy), horizon)
    return math.hypot(px + vx * time, py + vy * time) >= obstacle.clearance
