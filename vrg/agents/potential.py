"""The minnow's potential field (thesis, Figure 4.13) and what it does with a shark that is near."""

import math
from collections.abc import Sequence

from vrg.agents.control import scaled
from vrg.regions import Region
from vrg.types import Vector

SHARK_WEIGHT = 0.6
"""Push away from the sharks' barycentre against the pull of the safe zone. Below 1, so that a minnow never stands
still or turns back for sharks that are far."""


def descent(position: Vector, safe: Region, sharks: Sequence[Vector]) -> Vector:
    """-grad F: linear towards the safe zone, linear away from the barycentre of the sharks. A direction, not a speed.

    A field that is linear in the distance has a gradient of constant length: each part is a unit vector.
    """
    target = safe.shrunk(0.5).nearest(*position)
    ux, uy = scaled((target[0] - position[0], target[1] - position[1]), 1.0)
    if sharks:
        bx = sum(s[0] for s in sharks) / len(sharks)
        by = sum(s[1] for s in sharks) / len(sharks)
        ax, ay = scaled((position[0] - bx, position[1] - by), SHARK_WEIGHT)
        ux, uy = ux + ax, uy + ay
    return ux, uy


def evade(position: Vector, shark: Vector, safe: Region, bounds: Region) -> Vector:
    """Directly away from one shark, along the border where away would be out of bounds.

    Along a border the way that leads to the safe zone is taken unless the shark is on it.

    Args:
        bounds: where the body's centre may be.
    """
    away = scaled((position[0] - shark[0], position[1] - shark[1]), 1.0)
    step = 0.5
    x, y = bounds.nearest(position[0] + step * away[0], position[1] + step * away[1])
    moved = x - position[0], y - position[1]
    if math.hypot(*moved) > step / 2:
        return scaled(moved, 1.0)
    # In a corner or against a border: past the shark on the side with more room.
    target = safe.nearest(*position)
    goal = scaled((target[0] - position[0], target[1] - position[1]), 1.0)
    left, right = (-away[1], away[0]), (away[1], -away[0])

    def room(side: Vector) -> float:
        end = bounds.nearest(position[0] + 3 * side[0], position[1] + 3 * side[1])
        return math.hypot(end[0] - position[0], end[1] - position[1]) + side[0] * goal[0] + side[1] * goal[1]

    return max(left, right, key=room)
