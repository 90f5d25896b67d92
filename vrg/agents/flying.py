"""Flying an aerial robot to a place, for strategies."""

import math

from vrg.agents.strategy import View
from vrg.geometry import ahead
from vrg.navigation.control import scaled
from vrg.portable.scalars import atan2, cos_sin
from vrg.regions import Region
from vrg.types import STILL, Twist, Vector

HEADROOM = 0.05
"""The distance in m below its ceiling at which it climbs no more."""
ROUND, LEAD = 0.6, 0.6
"""The radius of the circle on which it patrols, as a part of the distance from a region's middle to its border, and the
angle in rad by which it aims ahead on the circle."""


def above(view: View, place: Vector) -> Twist:
    """The twist that leads an aerial robot above a place, as high as it flies; STILL for a robot on the ground.

    It flies at top speed, slows down in the last second, and keeps its heading.

    Args:
        place: m in the map's frame.
    """
    drivetrain = view.robot.flies
    if drivetrain is None:
        return STILL
    way = place[0] - view.pose.x, place[1] - view.pose.y
    vx, vy = scaled(way, min(view.robot.v_max, math.hypot(*way)))
    cos, sin = cos_sin(view.pose.theta)
    climb = drivetrain.climb if view.pose.z < drivetrain.ceiling - HEADROOM else 0.0
    return Twist(vx * cos + vy * sin, 0.0, vy * cos - vx * sin, climb)


def patrol(view: View, region: Region) -> Vector:
    """The place to aim at, m, that leads it round the middle of a region, counter-clockwise."""
    x, y = region.middle
    return ahead(x, y, atan2(view.pose.y - y, view.pose.x - x) + LEAD, ROUND * region.depth(x, y))
