"""Evasion of taggers: the safest of many directions, all computed together as arrays.

A point is safe by as many seconds as its player is there before every opponent could be, if each drove straight to it.
This is the dominance region of pursuit and evasion: inside it the player is first, whatever the opponents do.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.portable.arrays import cos_sin_array, hypot
from vrg.regions import Bounds, Circle
from vrg.types import Vector

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Safe = Callable[[Floats], Flags]
"""Tells of points, shape (..., 2), in m, which cannot be harmful: shape (...)."""

DIRECTIONS = 24
"""The number of directions that are looked at; the first leads straight to the goal."""
DISTANCES: Floats = np.array([0.4, 0.8, 1.4, 2.2, 3.2, 4.5])
"""The distances in m ahead at which each direction is looked at."""
LEVEL = 3.0
"""The number of seconds by which a point is safe at most: more is no better."""
SAFER: Final = 0.05
"""The progress in m that is worth as much as a second of safety more."""
NEARER: Final = 0.1
"""The seconds of safety that a metre of progress is worth, where no way is safe."""
TURNED: Final = 0.02
"""The progress in m that a turn by a radian costs: of ways that are about as good, the one that turns least."""
EVEN: Final = 1e9
"""The number of steps in 1 to which values are rounded before the best is chosen. Ways to both sides are often equally
good: then the first one counts, which is that to the left, and not what rounding has left of a difference."""
_HALF = np.arange(1, DIRECTIONS // 2) * (math.tau / DIRECTIONS)
_TURNS: Floats = np.concatenate(([0.0], _HALF, [math.pi], -_HALF[::-1]))
UNITS: Floats = np.stack(cos_sin_array(_TURNS), axis=-1)
"""The unit vectors of the directions, where the first leads along x: shape (DIRECTIONS, 2)."""
TURN_COSTS: Floats = TURNED * np.abs(_TURNS)
"""What the turn to each direction from the one straight to the goal costs, m."""


@dataclass(frozen=True, slots=True)
class BestDirection:
    """The best direction.

    Args:
        heading: the unit vector that leads there. progress: how much nearer to the goal its safe part ends, m.
        margin: the number of seconds by which its first points are safe; negative where an opponent can be first.
    """

    heading: Vector
    progress: float
    margin: float


def best_course(
    place: Vector,
    goal: Vector,
    hunters: Floats,
    *,
    speed: float,
    reach: float,
    margin: float,
    inside: Safe,
    harmless: Safe,
) -> BestDirection:
    """The direction that leads nearest to the goal over points that are safe by at least `margin` s.

    If not even the first points of any direction are so safe, it is the direction whose first points are safest.

    Args:
        place, goal: where the player is and wants to be, m.
        hunters: where those are that can tag it: shape (n, 2), m.
        speed: the top speed of all, m/s. reach: the distance at which a player is tagged, m.
        inside: which points one may drive to. harmless: where one cannot be tagged.
    """
    here, there = np.array(place), np.array(goal)
    far = math.dist(place, goal)
    cos, sin = ((goal[0] - place[0]) / far, (goal[1] - place[1]) / far) if far else (1.0, 0.0)
    units = UNITS * cos + UNITS[:, ::-1] * (-sin, sin)
    distances = np.minimum(DISTANCES, max(far, DISTANCES[0]))
    points = here + units[:, None, :] * distances[None, :, None]
    spare = _spare(points, distances, hunters, speed, reach)
    spare[harmless(points)] = LEVEL
    spare[~inside(points)] = -LEVEL
    # A way is as safe as its least safe point so far.
    level = np.minimum.accumulate(spare, axis=1)
    progress = far - hypot(*np.moveaxis(points - there, -1, 0))
    good = level >= margin
    if good[:, 0].any():
        value = np.where(good, progress + SAFER * level, -np.inf).max(axis=1)
        best = int(np.argmax(np.rint((value - TURN_COSTS) * EVEN)))
        return BestDirection((float(units[best, 0]), float(units[best, 1])), float(value[best]), float(level[best, 0]))
    best = int(np.argmax(np.rint((level[:, 1] + NEARER * progress[:, 1]) * EVEN)))
    return BestDirection((float(units[best, 0]), float(units[best, 1])), 0.0, float(level[best, 0]))


def points_in_disc(points: Floats, disc: Circle) -> Flags:
    """True for each point, shape (..., 2), that is inside a disc."""
    dx, dy = points[..., 0] - disc.x, points[..., 1] - disc.y
    inside: Flags = dx * dx + dy * dy < disc.radius * disc.radius
    return inside


def in_bounds(points: Floats, bounds: Bounds) -> Flags:
    """True for each point, shape (..., 2), that is inside a rectangle (x_min, y_min, x_max, y_max)."""
    x, y = points[..., 0], points[..., 1]
    inside: Flags = (x >= bounds[0]) & (y >= bounds[1]) & (x <= bounds[2]) & (y <= bounds[3])
    return inside


def _spare(points: Floats, distances: Floats, hunters: Floats, speed: float, reach: float) -> Floats:
    """The time in s by which a player is at each point before the first hunter, at most LEVEL."""
    if not len(hunters):
        return np.full(points.shape[:2], LEVEL)
    away = points[:, :, None, :] - hunters
    nearest = np.sqrt((away * away).sum(axis=-1).min(axis=-1))
    spare: Floats = np.minimum((np.maximum(nearest - reach, 0.0) - distances) / speed, LEVEL)
    return spare
