"""Plane geometry of poses and bodies, in metres and radians. It uses plain floats, because the sets are small."""

import math

from vrg.portable.scalars import cos_sin, hypot, sin
from vrg.types import LEVEL, Pose, Twist, Uncertainty, Vector

SIGMAS = 2.0
"""The number of standard deviations within which a value is taken to be: about 95 % of the time."""


def wrap(angle: float) -> float:
    """Return the same angle within [-pi, pi]."""
    return math.remainder(angle, math.tau)


def ahead(x: float, y: float, heading: float, distance: float) -> Vector:
    """Return the point at a distance, m, from (x, y) in the direction of a heading, rad."""
    cos, sin = cos_sin(heading)
    return x + distance * cos, y + distance * sin


def compose(start: Pose, by: Pose) -> Pose:
    """Return the pose `by`, which is given in the frame of `start`, in the frame in which `start` is given."""
    cos, sin = cos_sin(start.theta)
    x, y = start.x + by.x * cos - by.y * sin, start.y + by.x * sin + by.y * cos
    return Pose(x, y, wrap(start.theta + by.theta), start.z + by.z or LEVEL)


def inverse(pose: Pose) -> Pose:
    """Return the inverse of a pose: composed with `pose` it gives (0, 0, 0)."""
    cos, sin = cos_sin(pose.theta)
    return Pose(-pose.x * cos - pose.y * sin, pose.x * sin - pose.y * cos, wrap(-pose.theta), -pose.z or LEVEL)


def along_arc(pose: Pose, twist: Twist, seconds: float) -> Pose:
    """Return the pose of a body that moves with a twist for `seconds` from `pose` on. Its heading may pass pi."""
    half = twist.w * seconds / 2
    time = seconds * (sin(half) / half if half else 1.0)
    cos, sine = cos_sin(pose.theta + half)
    x, y = (twist.v * cos - twist.side * sine) * time, (twist.v * sine + twist.side * cos) * time
    return Pose(pose.x + x, pose.y + y, pose.theta + 2 * half, pose.z + twist.climb * seconds or LEVEL)


def arc_between(before: Pose, after: Pose) -> Twist:
    """Return the way, turn and way to the left of a body that has moved steadily from one pose to another, m and rad.

    It is the twist with which `along_arc` gets there in 1 s, turning by less than pi.
    """
    turn = wrap(after.theta - before.theta)
    half = turn / 2
    scale = half / sin(half) if half else 1.0
    cos, sine = cos_sin(before.theta + half)
    x, y = (after.x - before.x) * scale, (after.y - before.y) * scale
    return Twist(cos * x + sine * y, turn, cos * y - sine * x, after.z - before.z or LEVEL)


def interpolate(a: Pose, b: Pose, fraction: float) -> Pose:
    """Return the pose between a (fraction 0) and b (fraction 1). The heading turns the short way."""
    return Pose(
        a.x + (b.x - a.x) * fraction,
        a.y + (b.y - a.y) * fraction,
        a.theta + wrap(b.theta - a.theta) * fraction,
        a.z + (b.z - a.z) * fraction or LEVEL,
    )


def corners(pose: Pose, length: float, width: float) -> list[Vector]:
    """Return the corners of a body's outline, counter-clockwise from front left, in m."""
    c, s = cos_sin(pose.theta)
    a, b = length / 2, width / 2
    return [(pose.x + c * u - s * v, pose.y + s * u + c * v) for u, v in ((a, b), (-a, b), (-a, -b), (a, -b))]


def ellipse(x: float, y: float, known: Uncertainty, corners: int = 24) -> list[Vector]:
    """Return the corners of a polygon for the ellipse within SIGMAS standard deviations about a place, m."""
    a, b, direction = known.ellipse
    cos, sin = (each * SIGMAS for each in cos_sin(direction))
    turns = [cos_sin(math.tau * number / corners) for number in range(corners)]
    return [(x + cos * a * c - sin * b * s, y + sin * a * c + cos * b * s) for c, s in turns]


def separation(first: Pose, second: Pose, first_size: Vector, second_size: Vector) -> tuple[float, float, float]:
    """Return how far two bodies are apart along the axis that separates them best (separating-axis theorem).

    Args:
        first_size, second_size: the (length, width) of the bodies, m.

    Returns:
        the distance, m: negative if they overlap by that much, and a lower bound if they are apart corner to corner;
        and the unit vector x, y of the axis, which points from the second body towards the first.
    """
    dx, dy = first.x - second.x, first.y - second.y
    (ca, sa), (cb, sb) = cos_sin(first.theta), cos_sin(second.theta)
    cos, sin = abs(ca * cb + sa * sb), abs(sa * cb - ca * sb)
    la, wa, lb, wb = first_size[0] / 2, first_size[1] / 2, second_size[0] / 2, second_size[1] / 2
    best = (-math.inf, 0.0, 0.0)
    for ux, uy, reach in (
        (ca, sa, la + lb * cos + wb * sin),
        (-sa, ca, wa + lb * sin + wb * cos),
        (cb, sb, lb + la * cos + wa * sin),
        (-sb, cb, wb + la * sin + wa * cos),
    ):
        along = dx * ux + dy * uy
        distance = abs(along) - reach
        if distance > best[0]:
            best = (distance, ux, uy) if along >= 0 else (distance, -ux, -uy)
    return best


def outline_distance(first: Pose, second: Pose, first_size: Vector, second_size: Vector) -> float:
    """Return the distance between the outlines of two bodies in m; 0 if they touch or overlap.

    Args:
        first_size, second_size: the (length, width) of the bodies, m.
    """
    if separation(first, second, first_size, second_size)[0] <= 0.0:
        return 0.0
    a, b = corners(first, *first_size), corners(second, *second_size)
    # Of two convex outlines that do not overlap, the nearest pair of points has a corner of one of them in it.
    return min(_corners_to_body(b, first, first_size), _corners_to_body(a, second, second_size))


def nearest_points(first: Pose, second: Pose, first_size: Vector, second_size: Vector) -> tuple[Vector, Vector]:
    """Return the points of two outlines that are nearest to each other, m; of bodies that overlap, their centres.

    Args:
        first_size, second_size: the (length, width) of the bodies, m.
    """
    if outline_distance(first, second, first_size, second_size) == 0.0:
        return (first.x, first.y), (second.x, second.y)
    found = [(_onto(corner, first, first_size), corner) for corner in corners(second, *second_size)]
    found += [(corner, _onto(corner, second, second_size)) for corner in corners(first, *first_size)]
    return min(found, key=lambda pair: math.dist(*pair))


def _onto(point: Vector, pose: Pose, size: Vector) -> Vector:
    """The point of a body that is nearest to a point outside it."""
    c, s = cos_sin(pose.theta)
    dx, dy = point[0] - pose.x, point[1] - pose.y
    u = max(-size[0] / 2, min(c * dx + s * dy, size[0] / 2))
    v = max(-size[1] / 2, min(c * dy - s * dx, size[1] / 2))
    return pose.x + c * u - s * v, pose.y + s * u + c * v


def _corners_to_body(points: list[Vector], pose: Pose, size: Vector) -> float:
    (c, s), best = cos_sin(pose.theta), math.inf
    for x, y in points:
        dx, dy = x - pose.x, y - pose.y
        outside_u = max(abs(c * dx + s * dy) - size[0] / 2, 0.0)
        outside_v = max(abs(c * dy - s * dx) - size[1] / 2, 0.0)
        best = min(best, hypot(outside_u, outside_v))
    return best


def circumradius(size: Vector) -> float:
    """Return the radius of the circle around a body of (length, width), in m."""
    return math.hypot(size[0], size[1]) / 2
