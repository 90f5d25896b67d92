"""Segments, arcs and corners of convex polygons: pure functions of numbers."""

import math
from collections.abc import Sequence
from typing import Final

from vrg.geometry import ahead
from vrg.portable.scalars import acos, total
from vrg.types import Vector

CHORD = 0.01
"""The distance in m by which a drawn arc may differ from the true one."""
_TINY = 1e-9
"""The tolerance in m or m^2 by which rounding may move a corner to the wrong side."""


Stretch = tuple[float, float]
"""A part of a way, as two fractions of it; empty if the first is the greater one."""
NEVER: Final[Stretch] = (math.inf, -math.inf)


def some(stretch: Stretch) -> Stretch | None:
    """A stretch, or None if it is empty."""
    return stretch if stretch[0] <= stretch[1] else None


def in_disc(start: Vector, end: Vector, centre: Vector, radius: float) -> Stretch | None:
    """The part of a way that is in a disc; None if there is none."""
    return some(disc_part(start, end, centre, radius))


def disc_part(start: Vector, end: Vector, centre: Vector, radius: float) -> Stretch:
    """The part of a way that is in a disc; NEVER if there is none."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    fx, fy = start[0] - centre[0], start[1] - centre[1]
    a, b, c = dx * dx + dy * dy, fx * dx + fy * dy, fx * fx + fy * fy - radius * radius
    if a == 0.0:
        return (0.0, 1.0) if c <= 0.0 else NEVER
    discriminant = b * b - a * c
    if discriminant < 0.0:
        return NEVER
    root = math.sqrt(discriminant)
    enter, leave = max(0.0, (-b - root) / a), min(1.0, (-b + root) / a)
    return (enter, leave) if enter <= leave else NEVER


def in_box(start: Vector, end: Vector, box: tuple[float, float, float, float]) -> Stretch:
    """The part of a way that is in a box of (x_min, y_min, x_max, y_max), by Liang and Barsky's clipping."""
    enter, leave = 0.0, 1.0
    for a, b, low, high in ((start[0], end[0], box[0], box[2]), (start[1], end[1], box[1], box[3])):
        if a == b:
            if not low <= a <= high:
                return NEVER
            continue
        first, second = (low - a) / (b - a), (high - a) / (b - a)
        enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
    return enter, leave


def on_inner_sides(
    start: Vector, end: Vector, planes: Sequence[tuple[float, float, float]], stretch: Stretch
) -> Stretch:
    """The part of a stretch of the way that is on the inner side of every plane."""
    enter, leave = stretch
    for nx, ny, offset in planes:
        at_start = nx * start[0] + ny * start[1] - offset
        at_end = nx * end[0] + ny * end[1] - offset
        if at_start < 0.0 and at_end < 0.0:
            return NEVER
        if at_start < 0.0:
            enter = max(enter, at_start / (at_start - at_end))
        elif at_end < 0.0:
            leave = min(leave, at_start / (at_start - at_end))
    return enter, leave


def arc(centre: Vector, radius: float, start: float, sweep: float) -> list[Vector]:
    """Points of an arc, both ends included, so close together that no chord is farther than CHORD from the arc."""
    step = 2 * acos(max(0.0, 1.0 - CHORD / radius)) if radius > CHORD else math.pi / 4
    count = max(8, math.ceil(sweep / step))
    return [ahead(*centre, start + sweep * i / count, radius) for i in range(count + 1)]


def nearest_on_segment(point: Vector, a: Vector, b: Vector) -> Vector:
    dx, dy = b[0] - a[0], b[1] - a[1]
    square = dx * dx + dy * dy
    along = 0.0 if square == 0.0 else ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / square
    along = min(1.0, max(0.0, along))
    return a[0] + along * dx, a[1] + along * dy


def clipped(corners: list[Vector], nx: float, ny: float, offset: float) -> list[Vector]:
    """The part of a convex polygon with nx x + ny y >= offset (Sutherland and Hodgman)."""
    kept: list[Vector] = []
    for a, b in zip(corners, turned(corners), strict=True):
        at_a, at_b = nx * a[0] + ny * a[1] - offset, nx * b[0] + ny * b[1] - offset
        if at_a >= 0.0:
            kept.append(a)
        if at_a * at_b < 0.0:
            share = at_a / (at_a - at_b)
            kept.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
    return kept


def turned(points: Sequence[Vector], by: int = 1) -> list[Vector]:
    """The same corners in the same cyclic order, beginning `by` corners later."""
    return [*points[by:], *points[:by]]


def cross(a: Vector, b: Vector, c: Vector) -> float:
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def convex(corners: Sequence[Vector]) -> bool:
    """True if corners are those of a convex polygon, counter-clockwise. They may repeat, and be on a straight side.

    All turns of a convex polygon lead to the left, and on one way around it x grows once and falls once.
    """
    turns = [cross(a, b, c) for a, b, c in zip(corners, turned(corners), turned(corners, 2), strict=True)]
    ways = [b[0] - a[0] for a, b in zip(corners, turned(corners), strict=True)]
    grows = [way > 0.0 for way in ways if abs(way) > _TINY]
    changes = sum(a != b for a, b in zip(grows, [*grows[1:], *grows[:1]], strict=True))
    return min(turns) >= -_TINY and total(turns) > 0.0 and changes == 2


def centroid(points: Sequence[Vector]) -> Vector:
    return total(x for x, _ in points) / len(points), total(y for _, y in points) / len(points)


def area(points: Sequence[Vector]) -> float:
    """The area of a polygon whose corners are counter-clockwise, m^2 (the shoelace formula)."""
    return total(ax * by - bx * ay for (ax, ay), (bx, by) in zip(points, turned(points), strict=True)) / 2
