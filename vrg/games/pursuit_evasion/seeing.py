"""Checks whether a pursuer can have seen something: pure functions of all poses at the time of the measurement."""

import math
from collections.abc import Iterable, Mapping, Sequence

from vrg.bus.messages import Sighting
from vrg.coordinator.rulebook import Contestant
from vrg.geometry import compose, corners, wrap
from vrg.portable.scalars import atan2
from vrg.regions import Polygon, Region
from vrg.types import Pose

SIGHTING_REACH = 0.7
"""The distance in m between a sighting and the centre of the robot that it is of, at most."""
MOVED = 0.2
"""The distance in m by which a robot, or a camera above it, may have moved between a picture and the nearest look."""


def nearest(sighting: Sighting, names: Iterable[str], poses: Mapping[str, Pose]) -> tuple[float, str]:
    """The distance in m to the nearest of these players, and its name; infinite if none of them is in the world."""
    there = [(math.hypot(sighting.x - poses[n].x, sighting.y - poses[n].y), n) for n in names if n in poses]
    return min(there, default=(math.inf, ""))


def can_see(
    who: str, whom: str, poses: Mapping[str, Pose], contestants: Mapping[str, Contestant], walls: Sequence[Region]
) -> bool:
    """True if a range finder of one player can meet another one, or a camera that looks down can see it.

    The first can if the centre of the other's body or one of its corners is within what the range finder sweeps, and
    the straight line to it goes through no wall and no third robot, of those on the ground. A camera sees the centre
    within its cone, or MOVED beside it.
    """
    if who not in poses:
        return False
    if (camera := contestants[who].overview) is not None:
        eye, there = poses[who], poses[whom]
        if math.hypot(there.x - eye.x, there.y - eye.y) <= camera.reach(eye.z - there.z) + MOVED:
            return True
    bodies = [
        Polygon(tuple(corners(pose, *contestants[name].size)))
        for name, pose in poses.items()
        if name in contestants and name not in (who, whom) and not pose.z
    ]
    there = poses[whom]
    for sweep in contestants[who].sweeps:
        eye = compose(poses[who], sweep.mount)
        for x, y in ((there.x, there.y), *corners(there, *contestants[whom].size)):
            off = wrap(atan2(y - eye.y, x - eye.x) - eye.theta)
            if (
                math.hypot(x - eye.x, y - eye.y) <= sweep.range_max
                and abs(off) <= sweep.fov / 2 + 1e-9
                and all(region.inside((eye.x, eye.y), (x, y)) is None for region in (*walls, *bodies))
            ):
                return True
    return False
