"""The minnow's potential field (thesis, Figure 4.13), and how it evades a shark that is near."""

import math
from collections.abc import Sequence

from vrg.navigation.control import scaled
from vrg.portable.scalars import total
from vrg.regions import Region
from vrg.types import Vector, quantised

SHARK_WEIGHT = 0.45
"""The push away from the sharks' barycentre, relative to the pull of the safe zone. It is below 1, so that a minnow
never stands still or turns back because of sharks that are far away, nor leaves its lane for that along the border."""


def descent(position: Vector, goal: Vector, sharks: Sequence[Vector]) -> Vector:
    """The descent direction -grad F of the potential F. Its length is no speed.

    F grows linearly with the distance from the goal, a place in the safe zone, and falls linearly with that from the
    barycentre of the sharks. So each of the two parts of the gradient has a constant length: 1 and SHARK_WEIGHT.
    """
    ux, uy = scaled((goal[0] - position[0], goal[1] - position[1]), 1.0)
    if sharks:
        bx = total(s[0] for s in sharks) / len(sharks)
        by = total(s[1] for s in sharks) / len(sharks)
        ax, ay = scaled((position[0] - bx, position[1] - by), SHARK_WEIGHT)
        ux, uy = ux + ax, uy + ay
    return ux, uy


def evade(position: Vector, shark: Vector, safe: Region, bounds: Region, start: Region) -> Vector:
    """The unit vector that leads directly away from one shark, or past it if away is out of bounds or at the start.

    Past the shark it leads on the side that has more room and is more towards the safe zone, or to the left.

    Args:
        bounds: where the body's centre may be. start: the zone where minnows start, into which none flees.
    """
    away = scaled((position[0] - shark[0], position[1] - shark[1]), 1.0)
    step = 0.5
    x, y = bounds.nearest(position[0] + step * away[0], position[1] + step * away[1])
    moved = x - position[0], y - position[1]
    if math.hypot(*moved) > step / 2 and not start.contains(x, y):
        return scaled(moved, 1.0)
    target = safe.nearest(*position)
    goal = scaled((target[0] - position[0], target[1] - position[1]), 1.0)
    left, right = (-away[1], away[0]), (away[1], -away[0])

    def room(side: Vector) -> float:
        end = bounds.nearest(position[0] + 3 * side[0], position[1] + 3 * side[1])
        wide = math.hypot(end[0] - position[0], end[1] - position[1])
        return quantised(wide + side[0] * goal[0] + side[1] * goal[1])

    return max(left, right, key=room)
