"""Plane geometry of poses and bodies, in metres and radians. It uses plain floats, because the sets are small."""

import math

from vrg.types import Pose, Twist, Uncertainty, Vector

SIGMAS = 2.0
"""The number of standard deviations within which a value is taken to be: about 95 % of the time."""


def wrap(angle: float) -> float:
    """Return the same angle within [-pi, pi]."""
    return math.remainder(angle, math.tau)


def compose(start: Pose, by: Pose) -> Pose:
    """Return the pose `by`, which is given in the frame of `start`, in the frame in which `start` is given."""
    cos, sin = math.cos(start.theta), math.sin(start.theta)
    return Pose(start.x + by.x * cos - by.y * sin, start.y + by.x * sin + by.y * cos, wrap(start.theta + by.theta))


def inverse(pose: Pose) -> Pose:
    """Return the inverse of a pose: composed with `pose` it gives (0, 0, 0)."""
    cos, sin = math.cos(pose.theta), math.sin(pose.theta)
    return Pose(-pose.x * cos - pose.y * sin, pose.x * sin - pose.y * cos, wrap(-pose.theta))


def along_arc(pose: Pose, twist: Twist, seconds: float) -> Pose:
    """Return the pose of a body that moves with a twist for `seconds` from `pose` on. Its heading may pass pi."""
    half = twist.w * seconds / 2
    time = seconds * (math.sin(half) / half if half else 1.0)
    cos, sin = math.cos(pose.theta + half) * time, math.sin(pose.theta + half) * time
    x, y = twist.v * cos - twist.side * sin, twist.v * sin + twist.side * cos
    return Pose(pose.x + x, pose.y + y, pose.theta + 2 * half)


def arc_between(before: Pose, after: Pose) -> Twist:
    """Return the way, turn and way to the left of a body that has moved steadily from one pose to another, m and rad.

    It is the twist with which `along_arc` gets there in 1 s, turning by less than pi.
    """
    turn = wrap(after.theta - before.theta)
    half = turn / 2
    scale = half / math.sin(half) if half else 1.0
    cos, sin = math.cos(before.theta + half) * scale, math.sin(before.theta + half) * scale
    x, y = after.x - before.x, after.y - before.y
    return Twist(cos * x + sin * y, turn, cos * y - sin * x)


def interpolate(a: Pose, b: Pose, fraction: float) -> Pose:
    """Return the pose between a (fraction 0) and b (fraction 1). The heading turns the short way."""
    return Pose(
        a.x + (b.x - a.x) * fraction,
        a.y + (b.y - a.y) * fraction,
        a.theta + wrap(b.theta - a.theta) * fraction,
    )


def corners(pose: Pose, length: float, width: float) -> list[Vector]:
    """Return the corners of a body's outline, counter-clockwise from front left, in m."""
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    a, b = length / 2, width / 2
    return [(pose.x + c * u - s * v, pose.y + s * u + c * v) for u, v in ((a, b), (-a, b), (-a, -b), (a, -b))]


def ellipse(x: float, y: float, known: Uncertainty, corners: int = 24) -> list[Vector]:
    """Return the corners of a polygon for the ellipse within SIGMAS standard deviations about a place, m."""
    a, b, direction = known.ellipse
    cos, sin = math.cos(direction) * SIGMAS, math.sin(direction) * SIGMAS
    turns = [math.tau * number / corners for number in range(corners)]
    return [
        (x + cos * a * math.cos(t) - sin * b * math.sin(t), y + sin * a * math.cos(t) + cos * b * math.sin(t))
        for t in turns
    ]


def separation(first: Pose, second: Pose, first_size: Vector, second_size: Vector) -> tuple[float, float, float]:
    """Return how far two bodies are apart along the axis that separates them best (separating-axis theorem).

    Args:
        first_size, second_size: the (length, width) of the bodies, m.

    Returns:
        the distance, m: negative if they overlap by that much, and a lower bound if they are apart corner to corner;
        and the unit vector x, y of the axis, which points from the second body towards the first.
    """
    dx, dy = first.x - second.x, first.y - second.y
    ca, sa, cb, sb = math.cos(first.theta), math.sin(first.theta), math.cos(second.theta), math.sin(second.theta)
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
    u, v = _local(point, pose)
    u, v = max(-size[0] / 2, min(u, size[0] / 2)), max(-size[1] / 2, min(v, size[1] / 2))
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    return pose.x + c * u - s * v, pose.y + s * u + c * v


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


def circumradius(size: Vector) -> float:
    """Return the radius of the circle around a body of (length, width), in m."""
    return math.hypot(size[0], size[1]) / 2
