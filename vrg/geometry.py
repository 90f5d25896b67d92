"""Plane geometry of bodies and fields. Metres and radians; plain floats, because the sets are small."""

import math
from dataclasses import dataclass

from vrg.bus.messages import Pose

Vector = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Rectangle:
    """An axis-aligned rectangle, borders included."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float

    def contains(self, x: float, y: float) -> bool:
        """Whether the point is inside or on the border."""
        return self.x_min <= x <= self.x_max and self.y_min <= y <= self.y_max

    def shrunk(self, margin: float) -> "Rectangle":
        """The rectangle with every side moved inwards; a side longer than that allows collapses to its middle."""
        x, y = (self.x_min + self.x_max) / 2, (self.y_min + self.y_max) / 2
        return Rectangle(
            min(self.x_min + margin, x),
            min(self.y_min + margin, y),
            max(self.x_max - margin, x),
            max(self.y_max - margin, y),
        )

    def nearest(self, x: float, y: float) -> Vector:
        """The point of the rectangle that is nearest to (x, y)."""
        return min(max(x, self.x_min), self.x_max), min(max(y, self.y_min), self.y_max)

    def exit_fraction(self, start: Vector, end: Vector) -> float | None:
        """Where the segment from start to end first leaves: 0 at start, 1 at end, None where it stays inside."""
        if self.contains(*end) and self.contains(*start):
            return None
        if not self.contains(*start):
            return 0.0
        fraction = 1.0
        bounds = ((self.x_min, self.x_max), (self.y_min, self.y_max))
        for (low, high), a, b in zip(bounds, start, end, strict=True):
            if b > high:
                fraction = min(fraction, (high - a) / (b - a))
            elif b < low:
                fraction = min(fraction, (low - a) / (b - a))
        return fraction


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def compose(start: Pose, by: Pose) -> Pose:
    """The pose `by`, told in the frame of `start`, told in the frame that `start` is told in."""
    cos, sin = math.cos(start.theta), math.sin(start.theta)
    return Pose(start.x + by.x * cos - by.y * sin, start.y + by.x * sin + by.y * cos, wrap(start.theta + by.theta))


def interpolate(a: Pose, b: Pose, fraction: float) -> Pose:
    """The pose between a (fraction 0) and b (fraction 1), turning the short way."""
    return Pose(
        a.x + (b.x - a.x) * fraction,
        a.y + (b.y - a.y) * fraction,
        a.theta + wrap(b.theta - a.theta) * fraction,
    )


def corners(pose: Pose, length: float, width: float) -> list[Vector]:
    """The corners of a body's outline, counter-clockwise from front left."""
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    a, b = length / 2, width / 2
    return [(pose.x + c * u - s * v, pose.y + s * u + c * v) for u, v in ((a, b), (-a, b), (-a, -b), (a, -b))]


def outline_distance(first: Pose, second: Pose, first_size: Vector, second_size: Vector) -> float:
    """Distance between the outlines of two bodies; 0 where they touch or overlap.

    Args:
        first_size, second_size: (length, width) of the bodies.
    """
    a, b = corners(first, *first_size), corners(second, *second_size)
    if _overlap(first, first_size, b) and _overlap(second, second_size, a):
        return 0.0
    # Of two convex outlines that do not overlap, the nearest pair of points has a corner of one of them in it.
    return min(_corners_to_body(b, first, first_size), _corners_to_body(a, second, second_size))


def _local(point: Vector, pose: Pose) -> Vector:
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    dx, dy = point[0] - pose.x, point[1] - pose.y
    return c * dx + s * dy, c * dy - s * dx


def _corners_to_body(points: list[Vector], pose: Pose, size: Vector) -> float:
    best = math.inf
    for point in points:
        u, v = _local(point, pose)
        outside_u, outside_v = max(abs(u) - size[0] / 2, 0.0), max(abs(v) - size[1] / 2, 0.0)
        best = min(best, math.hypot(outside_u, outside_v))
    return best


def _overlap(pose: Pose, size: Vector, points: list[Vector]) -> bool:
    """Whether no axis of the body at `pose` separates it from the convex hull of `points`."""
    local = [_local(point, pose) for point in points]
    for axis, half in ((0, size[0] / 2), (1, size[1] / 2)):
        values = [p[axis] for p in local]
        if min(values) > half or max(values) < -half:
            return False
    return True


def circumradius(size: Vector) -> float:
    """Radius of the circle around a body of (length, width)."""
    return math.hypot(*size) / 2
