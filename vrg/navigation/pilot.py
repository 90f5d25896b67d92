"""Drives a robot to a place: around standing bodies, past moving ones, and out again where it is stuck.

Players drive by it, and so does the coordinator where it drives a robot itself. It uses no bus and no clock.
"""

import math
from collections.abc import Sequence

from vrg.navigation.avoidance import FreeArea, Obstacle, is_near, steer
from vrg.navigation.control import linearise, scaled, turn
from vrg.navigation.route import WAYPOINT_CLEARANCE, Effort, grown, route
from vrg.portable.scalars import atan2, cos_sin
from vrg.regions import Circle, Region
from vrg.types import STILL, Pose, Twist, Vector, quantised

OFFSET = 0.25
"""The distance in m from the body's centre to the point that feedback linearisation steers."""
CLEARANCE = 0.1
"""The distance in m to keep between the circles around two bodies, where there is room for it."""
TIGHT = 0.87
"""The part of the distance of two touching circles that is kept where there is no room: bodies are no circles."""
HORIZON = 1.2
"""The time in s ahead for which bodies in the way are avoided."""
STANDING = 0.1
"""The speed in m/s below which a way leads around a body."""
PROGRESS_TIMEOUT = 2.0
"""The match time in s without getting anywhere after which a robot drives out of the crowd."""
MAX_DECISION_INTERVAL = 0.5
"""The match time in s between two decisions beyond which the robot was not driven meanwhile."""
OUT = 1.0
"""The match time in s for which it does."""
PROGRESS = 0.15
"""The distance in m that counts as getting somewhere."""
EFFORT = 5000
"""The tests of pieces of ways against bodies and walls at one tick, a few milliseconds; a crowd of 16 needs 700.

Where they find no way, the robot drives straight on, past what is near.
"""
FACING = 0.2
"""The angle in rad to a place within which a robot that stands is turned towards it."""
SIDEWAYS = 0.7
"""The part of its velocity out of a crowd that is to the left, relative to the part away from the nearest body."""


class Pilot:
    """Drives one robot. It remembers since when the robot gets nowhere.

    The clearance of its neighbours is the sum of the radii of the circles around the other body and its own. It keeps a
    larger distance where there is room for it, and a smaller one where there is none.
    """

    def __init__(self) -> None:
        self._from: Vector | None = None
        self._since = 0.0
        self._last = 0.0
        self._out_until = -math.inf

    def go(
        self,
        now: float,
        pose: Pose,
        places: Sequence[Vector],
        neighbours: Sequence[Obstacle],
        bounds: FreeArea,
        speed: float,
        walls: Sequence[tuple[Region, float]] = (),
    ) -> Twist:
        """The twist that drives to the first of some places to which there is a way, or else towards the first one.

        Args:
            now: the match time, s. pose: where the robot is.
            bounds: where the body's centre should be. speed: m/s.
            walls: the regions that no robot can drive through, each with the distance to keep from it, m.
        """
        here = (pose.x, pose.y)
        standing = [n for n in neighbours if math.hypot(*n.velocity) < STANDING]
        target = places[0]
        solid = _solid(walls, here)
        if standing or solid:
            effort = Effort(EFFORT)
            ways = (
                way
                for factor, gap in ((1.0, CLEARANCE), (TIGHT, 0.0))
                for barring in [[Circle(*n.position, n.clearance * factor + gap) for n in standing] + solid]
                for place in places
                if (way := route(here, place, barring, bounds.contains, effort)) is not None
            )
            target = next(ways, [target])[0]
        wanted = scaled((target[0] - here[0], target[1] - here[1]), speed)
        return self._past(now, pose, wanted, neighbours, _free(bounds, solid))

    def head(
        self,
        now: float,
        pose: Pose,
        wanted: Vector,
        neighbours: Sequence[Obstacle],
        bounds: FreeArea,
        walls: Sequence[tuple[Region, float]] = (),
        offset: float = OFFSET,
    ) -> Twist:
        """The twist that drives with a wanted velocity (m/s in the map's frame), past the bodies that are near.

        Args:
            offset: the distance from the body's centre to the point that feedback linearisation steers, m. With a
                longer one a robot turns less at once.
        """
        free = _free(bounds, _solid(walls, (pose.x, pose.y)))
        return self._past(now, pose, wanted, neighbours, free, offset)

    def _past(
        self,
        now: float,
        pose: Pose,
        wanted: Vector,
        neighbours: Sequence[Obstacle],
        bounds: FreeArea,
        offset: float = OFFSET,
    ) -> Twist:
        here = (pose.x, pose.y)
        if self._stuck(now, here, wanted):
            wanted = _away(pose, neighbours, math.hypot(*wanted))
        u, speed = (0.0, 0.0), math.hypot(*wanted)
        for factor, gap in ((1.0, CLEARANCE / 2), (TIGHT, 0.0)):
            obstacles = [
                Obstacle(n.position, n.velocity, clearance)
                for n in neighbours
                for clearance in (n.clearance * factor + gap,)
                if is_near(here, speed, n, clearance, HORIZON)
            ]
            u = steer(here, wanted, obstacles, bounds, HORIZON)
            if u != (0.0, 0.0):
                break
        return linearise(u, pose.theta, offset)

    def stay(self, now: float, pose: Pose, towards: Vector | None = None) -> Twist:
        """The twist of a robot that stands where it is, turned towards a place if one is given."""
        self._begin(now, (pose.x, pose.y))
        if towards is None or math.dist(towards, (pose.x, pose.y)) < OFFSET:
            return STILL
        error = math.remainder(atan2(towards[1] - pose.y, towards[0] - pose.x) - pose.theta, math.tau)
        return turn(error, FACING)

    def _begin(self, now: float, here: Vector) -> None:
        """Count from now on for how long the robot gets nowhere."""
        self._from, self._since, self._last = here, now, now

    def _stuck(self, now: float, here: Vector, wanted: Vector) -> bool:
        """True if the robot has made no progress for long although it should, so that it must first get out."""
        pause = not 0.0 <= now - self._last <= MAX_DECISION_INTERVAL
        self._last = now
        if self._from is None or pause:
            # In a halt, or before the world was restarted, it was not to move.
            self._out_until = -math.inf
            self._begin(now, here)
            return False
        if now < self._out_until:
            return True
        if math.dist(self._from, here) > PROGRESS or math.hypot(*wanted) < PROGRESS:
            self._begin(now, here)
            return False
        if now - self._since <= PROGRESS_TIMEOUT:
            return False
        self._out_until, self._since = now + OUT, now + OUT
        return True


def _solid(walls: Sequence[tuple[Region, float]], here: Vector) -> list[Region]:
    """The ground that the centre of the body may not enter."""
    # A robot that is nearer to a wall than it should be must be able to leave it, but not to drive into it.
    margins = [(wall, min(margin, wall.distance(*here) - WAYPOINT_CLEARANCE)) for wall, margin in walls]
    return [grown(wall, margin) for wall, margin in margins if margin > 0.0]


def _free(region: FreeArea, walls: Sequence[Region]) -> FreeArea:
    return _Free(region, walls) if walls else region


class _Free:
    """The part of a region that walls leave free, as far as `steer` needs to know it."""

    def __init__(self, region: FreeArea, walls: Sequence[Region]) -> None:
        self._region = region
        self._walls = walls

    def contains(self, x: float, y: float) -> bool:
        """True if the point is in the region and in no wall."""
        return self._region.contains(x, y) and not any(wall.contains(x, y) for wall in self._walls)

    def nearest(self, x: float, y: float) -> Vector:
        """The nearest point of the region. A place in a wall counts as being there, so no way leads farther in."""
        return self._region.nearest(x, y)


def _away(pose: Pose, neighbours: Sequence[Obstacle], speed: float) -> Vector:
    """The velocity that leads away from the nearest body, and past it on the left; backwards if there is none."""
    here = (pose.x, pose.y)
    nearest = min(neighbours, key=lambda n: quantised(math.dist(n.position, here)), default=None)
    if nearest is None:
        cos, sin = cos_sin(pose.theta)
        return -cos * speed, -sin * speed
    dx, dy = here[0] - nearest.position[0], here[1] - nearest.position[1]
    return scaled((dx - SIDEWAYS * dy, dy + SIDEWAYS * dx), speed)
