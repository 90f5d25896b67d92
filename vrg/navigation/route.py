"""The shortest way to a place past bodies and walls that stand still, as a path of straight pieces.

Bodies are discs and walls are convex polygons. Only those that are in the way are looked at: the straight way first,
then a way by points around the first obstacles, until no other obstacle is on it. So a free way costs almost nothing.
"""

import heapq
import math
from collections.abc import Callable, Sequence

from vrg.geometry import ahead
from vrg.portable.scalars import cos
from vrg.regions import Circle, Polygon, Region
from vrg.segments import turned
from vrg.types import Vector

CORNERS = 8
"""The number of points around a disc that a way may turn at."""
WAYPOINT_CLEARANCE = 0.02
"""The distance in m that these points keep from the disc or the wall that they lead around."""
SHARP = 0.5
"""One plus the cosine of the angle between the outward directions of two sides, below which a corner is cut off."""
ATTEMPTS = 12
"""The number of times that obstacles which turn out to be in the way are added."""
_EPS = 1e-9


class Effort:
    """A bound on the work of searches, so that one where there is no way does not hold up the caller.

    Args:
        tests: how many times a piece of a way may be tested against an obstacle, in all searches together.
    """

    def __init__(self, tests: int) -> None:
        self._left = tests

    def spend(self, tests: int) -> bool:
        """Take that many tests; return False if there are none left."""
        self._left -= tests
        return self._left >= 0


def route(
    start: Vector,
    goal: Vector,
    obstacles: Sequence[Region],
    inside: Callable[[float, float], bool] = lambda x, y: True,
    effort: Effort | None = None,
) -> list[Vector] | None:
    """The shortest way that meets no obstacle, or None if there is none.

    Args:
        start, goal: where the way begins and ends, m.
        obstacles: what the way must not enter, already larger by the half width of what moves. If the start is inside
            a disc, the way must not lead farther into it; a polygon that the start is in is ignored.
        inside: whether a way may turn at the point (x, y), for example because it is inside the field.
        effort: bounds the search: where none is left, no way is found. None searches to the end.

    Returns:
        the points at which the way turns, and the goal as the last one.
    """
    if not all(map(math.isfinite, (*start, *goal))):
        return None
    barring = [smaller for o in obstacles if (smaller := _outside(o, start)) is not None]
    if any(_contains(obstacle, goal) for obstacle in barring):
        return None
    near: list[Region] = []
    path: list[Vector] | None = [goal]
    for _ in range(ATTEMPTS):
        if path is None:
            return None
        legs = list(zip([start, *path], path, strict=False))
        met = [o for o in barring if o not in near and any(_meets(o, a, b) for a, b in legs)]
        if not met:
            return path
        near += met
        points = [p for o in near for p in _around(o) if inside(*p) and not any(_contains(other, p) for other in near)]
        path = _shortest(start, goal, points, near, effort)
    return None


def grown(region: Region, margin: float) -> Region:
    """The region that no centre of a body with the half width `margin` m may enter, if `region` is filled by a body."""
    if isinstance(region, Circle):
        return Circle(region.x, region.y, region.radius + margin)
    corners = region.outline()
    points = []
    for before, corner, after in zip(turned(corners, -1), corners, turned(corners), strict=True):
        (ax, ay), (bx, by) = _normal(before, corner), _normal(corner, after)
        wide = 1.0 + ax * bx + ay * by
        if wide >= SHARP:
            # The corner of the two sides that are moved outwards.
            scale = margin / wide
            points.append((corner[0] + (ax + bx) * scale, corner[1] + (ay + by) * scale))
        else:
            # That corner would be far away. Each side is only made longer by the margin.
            points.append((corner[0] + margin * (ax - ay), corner[1] + margin * (ay + ax)))
            points.append((corner[0] + margin * (bx + by), corner[1] + margin * (by - bx)))
    return Polygon(tuple(points))


def _normal(a: Vector, b: Vector) -> Vector:
    """The unit vector that leads outwards from the side from a to b of a region, counter-clockwise."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    size = math.hypot(dx, dy) or 1.0
    return dy / size, -dx / size


def _outside(obstacle: Region, start: Vector) -> Region | None:
    """The obstacle as it is for a way that begins at `start`: a disc so much smaller that the start is outside it."""
    if not _contains(obstacle, start):
        return obstacle
    if not isinstance(obstacle, Circle):
        return None
    away = math.hypot(start[0] - obstacle.x, start[1] - obstacle.y) - WAYPOINT_CLEARANCE
    return Circle(obstacle.x, obstacle.y, away) if away > 0.0 else None


def _contains(obstacle: Region, point: Vector) -> bool:
    if isinstance(obstacle, Circle):
        return math.hypot(point[0] - obstacle.x, point[1] - obstacle.y) < obstacle.radius - _EPS
    return obstacle.contains(*point)


def _meets(obstacle: Region, start: Vector, end: Vector) -> bool:
    """True if the straight way from start to end enters an obstacle."""
    stretch = obstacle.inside(start, end)
    return stretch is not None and stretch[1] - stretch[0] > _EPS


def _around(obstacle: Region) -> list[Vector]:
    """The points around an obstacle at which a way may turn."""
    if isinstance(obstacle, Circle):
        # The sides of the polygon through these points do not enter the disc.
        radius = (obstacle.radius + WAYPOINT_CLEARANCE) / cos(math.pi / CORNERS)
        angles = [math.tau * (i + 0.5) / CORNERS for i in range(CORNERS)]
        return [ahead(obstacle.x, obstacle.y, angle, radius) for angle in angles]
    return grown(obstacle, WAYPOINT_CLEARANCE).outline()


def _shortest(
    start: Vector, goal: Vector, points: Sequence[Vector], obstacles: Sequence[Region], effort: Effort | None
) -> list[Vector] | None:
    """The shortest way over some of the points (A* search); each of its pieces is free.

    Lengths are whole micrometres, whose sums are exact: of two ways as long, such as those around both sides of an
    obstacle, the one over the earlier points counts, and not the last bit of a sum.
    """
    nodes = [start, *points, goal]
    last = len(nodes) - 1
    best = {0: 0}
    before: dict[int, int] = {}
    queue = [(_micrometres(start, goal), 0)]
    done: set[int] = set()
    while queue:
        _, node = heapq.heappop(queue)
        if node in done:
            continue
        if node == last:
            return [nodes[i] for i in _trace(before, last)]
        done.add(node)
        for other in range(1, len(nodes)):
            if other in done:
                continue
            cost = best[node] + _micrometres(nodes[node], nodes[other])
            if cost >= best.get(other, math.inf):
                continue
            if effort is not None and not effort.spend(len(obstacles)):
                return None
            if not any(_meets(o, nodes[node], nodes[other]) for o in obstacles):
                best[other], before[other] = cost, node
                heapq.heappush(queue, (cost + _micrometres(nodes[other], goal), other))
    return None


def _micrometres(a: Vector, b: Vector) -> int:
    return round(1e6 * math.dist(a, b))


def _trace(before: dict[int, int], node: int) -> list[int]:
    """The nodes from the one after the start to this one."""
    found = []
    while node:
        found.append(node)
        node = before[node]
    return found[::-1]
