"""Checks that a robot can stand at a goal. Pure functions of metres."""

from collections.abc import Sequence
from dataclasses import dataclass

from vrg.regions import Region
from vrg.types import Vector
from vrg_views.hud import words
from vrg_views.hud.helm import Goal


@dataclass(frozen=True)
class Ground:
    """The ground on which a robot can stand.

    Args:
        bounds: the part of the plane that the map has. walls: the ground that walls and obstacles cover.
        radius: of the circle around the robot's body, m.
    """

    bounds: Region
    walls: Sequence[Region]
    radius: float


@dataclass(frozen=True)
class OtherRobot:
    """Another robot that the player knows: its name, its centre in m, its velocity in m/s and its radius in m."""

    name: str
    place: Vector
    velocity: Vector
    radius: float


def refusal(goal: Goal, ground: Ground, others: Sequence[OtherRobot] = ()) -> str | None:
    """Why a robot cannot stand at a goal, in words; None if it can."""
    x, y, radius = goal.x, goal.y, ground.radius
    x_min, y_min, x_max, y_max = ground.bounds.bounds
    if not ground.bounds.contains(x, y):
        return words.OUTSIDE.format(x=x, y=y, x_min=x_min, y_min=y_min, x_max=x_max, y_max=y_max)
    if not ground.bounds.shrunk(radius).contains(x, y):
        return words.AT_BORDER.format(x=x, y=y, radius=radius)
    distance = min((wall.distance(x, y) for wall in ground.walls), default=radius)
    if distance <= 0.0:
        return words.IN_WALL.format(x=x, y=y)
    if distance < radius:
        return words.AT_WALL.format(x=x, y=y, distance=distance, radius=radius)
    for other in others:
        moves = other.velocity[0] ** 2 + other.velocity[1] ** 2 > 0.01
        if not moves and (other.place[0] - x) ** 2 + (other.place[1] - y) ** 2 < (radius + other.radius) ** 2:
            return words.TAKEN_PLACE.format(x=x, y=y, other=other.name)
    return None
