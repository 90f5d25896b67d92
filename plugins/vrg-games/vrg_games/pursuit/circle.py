"""The circle of Apollonius: where a slower evader and a faster pursuer can arrive at the same time."""

import math

from vrg.portable.scalars import square
from vrg.regions import Circle, Region
from vrg.types import Vector


def apollonius(evader: Vector, pursuer: Vector, ratio: float) -> Circle:
    """The circle of the points whose distances from evader and pursuer have a ratio. The evader is inside.

    Points that drive straight, from now on and at their top speeds, meet on it: each point inside is reached by the
    evader first, and each outside by the pursuer (R. Isaacs, Differential Games, 1965, on guarding a target).

    Args:
        evader, pursuer: two places, m. ratio: the evader's speed as a share of the pursuer's, 0 < ratio < 1.
    """
    share = square(ratio)
    x, y = ((e - share * p) / (1.0 - share) for e, p in zip(evader, pursuer, strict=True))
    return Circle(x, y, max(ratio * math.dist(evader, pursuer) / (1.0 - share), 1e-6))


def nearest_to(circle: Circle, goal: Region) -> Vector:
    """The point of a disc that is nearest to a goal, or if they overlap, a point of both, m."""
    x, y = goal.nearest(*circle.middle)
    return circle.nearest(x, y)
