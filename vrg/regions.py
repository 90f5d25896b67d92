"""Regions of a field: rectangles, circles, sectors and convex polygons behind one type.

The referee judges with the same object that the windows draw: `contains`, `inside` and `nearest` are exact, and
`outline` gives the points to draw. Every region is convex, so at most one stretch of a straight way is inside it.
A region is of the plane, with an extent in height that `holds` alone asks for.
A region travels on the bus as a map whose field `shape` names one of the four. Match files and map files write
it in the same way, for example `{ shape = "circle", x = 1.0, y = 2.0, radius = 0.6 }`.
"""

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Annotated

from msgspec import Meta, Struct
from msgspec.structs import replace

from vrg.geometry import ahead
from vrg.portable.scalars import atan2, cos_sin
from vrg.segments import (
    arc,
    area,
    centroid,
    clipped,
    convex,
    disc_part,
    in_box,
    in_disc,
    nearest_on_segment,
    on_inner_sides,
    some,
    turned,
)
from vrg.types import Length, Metres, Pose, Radians, Vector

Bounds = tuple[float, float, float, float]
"""The smallest axis-aligned rectangle around something: (x_min, y_min, x_max, y_max), m."""

_EPS = 1e-12


def surrounding(boxes: Iterable[Bounds]) -> Bounds:
    """The smallest bounds around all of these, of which there must be at least one, m."""
    x_min, y_min, x_max, y_max = zip(*boxes, strict=True)
    return min(x_min), min(y_min), max(x_max), max(y_max)


class _Shape(Struct, frozen=True, kw_only=True, tag_field="shape", forbid_unknown_fields=True, omit_defaults=True):
    """The base class of all regions. The border belongs to the region.

    Args:
        z_min: the height at which it begins, m. z_max: the height at which it ends, m; None if it has no upper end.
    """

    z_min: Metres = 0.0
    z_max: Metres | None = None

    def __post_init__(self) -> None:
        if self.z_max is not None and self.z_min > self.z_max:
            raise ValueError(f"expected z_min <= z_max, got {self.z_min:g} and {self.z_max:g}")

    def holds(self, pose: Pose) -> bool:
        """True if a pose is inside in space: inside or on the border, and at a height within the region's."""
        return self.contains(pose.x, pose.y) and self.z_min <= pose.z <= (
            math.inf if self.z_max is None else self.z_max
        )

    def contains(self, x: float, y: float) -> bool:
        """True if the point is inside or on the border."""
        raise NotImplementedError

    def inside(self, start: Vector, end: Vector) -> tuple[float, float] | None:
        """The stretch of the straight way from start to end that is inside, as two fractions of the way, or None."""
        raise NotImplementedError

    def nearest(self, x: float, y: float) -> Vector:
        """The point of the region that is nearest to (x, y), which is (x, y) itself if it is inside, m."""
        raise NotImplementedError

    def shrunk(self, margin: float) -> "Region":
        """The region with its border moved inwards by `margin` m. If the margin is too large, a tiny part is left."""
        raise NotImplementedError

    def outline(self) -> list[Vector]:
        """The corners (x, y), counter-clockwise, m. Points stand for an arc; their chords are within 0.01 m of it."""
        raise NotImplementedError

    @property
    def middle(self) -> Vector:
        """A point inside, where a name can be written: the middle of the bounds, m."""
        x_min, y_min, x_max, y_max = self.bounds
        return (x_min + x_max) / 2, (y_min + y_max) / 2

    @property
    def bounds(self) -> Bounds:
        """The axis-aligned rectangle around the region: (x_min, y_min, x_max, y_max), m."""
        points = self.outline()
        xs, ys = [x for x, _ in points], [y for _, y in points]
        return min(xs), min(ys), max(xs), max(ys)

    def distance(self, x: float, y: float) -> float:
        """The distance from the point to the region, m; 0 inside."""
        return 0.0 if self.contains(x, y) else math.dist((x, y), self.nearest(x, y))

    def signed_distance(self, x: float, y: float) -> float:
        """The distance from the point to the border, m: positive outside, and negative or 0 inside."""
        return -self.depth(x, y) if self.contains(x, y) else self.distance(x, y)

    def depth(self, x: float, y: float) -> float:
        """The distance from a point inside to the border, m; where points stand for an arc, to their chords."""
        corners = self.outline()
        sides = zip(corners, turned(corners), strict=True)
        return min(math.dist((x, y), nearest_on_segment((x, y), a, b)) for a, b in sides)

    def exit_fraction(self, start: Vector, end: Vector) -> float | None:
        """The fraction of the way from start to end at which it leaves the region; None if it ends inside.

        It is 0 for a way that starts outside.
        """
        if not self.contains(*start):
            return 0.0
        if self.contains(*end):
            return None
        stretch = self.inside(start, end)
        return stretch[1] if stretch is not None else 0.0


class Rectangle(_Shape, frozen=True, tag="rectangle"):
    """An axis-aligned rectangle.

    Args:
        x_min: the left border, m. y_min: the lower border, m. x_max: the right border, m. y_max: the upper border, m.
    """

    x_min: Metres
    y_min: Metres
    x_max: Metres
    y_max: Metres

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.x_min > self.x_max or self.y_min > self.y_max:
            raise ValueError(f"expected x_min <= x_max and y_min <= y_max, got {self.bounds}")

    @property
    def bounds(self) -> Bounds:
        """The borders of the rectangle itself."""
        return self.x_min, self.y_min, self.x_max, self.y_max

    def contains(self, x: float, y: float) -> bool:
        """True if the point is inside or on the border."""
        return self.x_min <= x <= self.x_max and self.y_min <= y <= self.y_max

    def inside(self, start: Vector, end: Vector) -> tuple[float, float] | None:
        """The stretch that is inside."""
        return some(in_box(start, end, self.bounds))

    def nearest(self, x: float, y: float) -> Vector:
        """The point of the rectangle that is nearest to (x, y)."""
        return min(max(x, self.x_min), self.x_max), min(max(y, self.y_min), self.y_max)

    def shrunk(self, margin: float) -> "Rectangle":
        """The rectangle with its sides moved inwards. Sides that would cross meet in the middle."""
        x, y = self.middle
        return Rectangle(
            min(self.x_min + margin, x),
            min(self.y_min + margin, y),
            max(self.x_max - margin, x),
            max(self.y_max - margin, y),
            z_min=self.z_min,
            z_max=self.z_max,
        )

    def outline(self) -> list[Vector]:
        """The four corners, counter-clockwise."""
        x_min, y_min, x_max, y_max = self.bounds
        return [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]


class Circle(_Shape, frozen=True, tag="circle"):
    """A full circle about (x, y).

    Args:
        x, y: the centre, m. radius: the radius, m.
    """

    x: Metres
    y: Metres
    radius: Length

    @property
    def middle(self) -> Vector:
        """The centre of the circle."""
        return self.x, self.y

    @property
    def bounds(self) -> Bounds:
        """The square around the circle."""
        return self.x - self.radius, self.y - self.radius, self.x + self.radius, self.y + self.radius

    def contains(self, x: float, y: float) -> bool:
        """True if the point is inside or on the border."""
        return math.hypot(x - self.x, y - self.y) <= self.radius

    def inside(self, start: Vector, end: Vector) -> tuple[float, float] | None:
        """The stretch that is inside, from the roots of a quadratic equation."""
        return in_disc(start, end, (self.x, self.y), self.radius)

    def depth(self, x: float, y: float) -> float:
        """The distance from a point inside to the border, m."""
        return self.radius - math.hypot(x - self.x, y - self.y)

    def nearest(self, x: float, y: float) -> Vector:
        """The point itself if it is inside, or the nearest point of the border."""
        dx, dy = x - self.x, y - self.y
        away = math.hypot(dx, dy)
        if away <= self.radius:
            return x, y
        return self.x + dx * self.radius / away, self.y + dy * self.radius / away

    def shrunk(self, margin: float) -> "Circle":
        """A circle about the same centre, smaller by `margin` m but never smaller than 1e-6 m."""
        return replace(self, radius=max(self.radius - margin, 1e-6))

    def outline(self) -> list[Vector]:
        """Points of the border, counter-clockwise."""
        points = arc(self.middle, self.radius, 0.0, math.tau)
        return points[:-1]


class Sector(_Shape, frozen=True, tag="sector"):
    """A part of a circle about (x, y), such as the quarter circle in a corner of a field.

    Args:
        x, y: the centre of the circle, which is the corner of the sector, m. radius: the radius, m.
        start: the direction of the first edge, rad, counter-clockwise from +x.
        sweep: the angle counter-clockwise from there to the other edge, rad, at most pi.
    """

    x: Metres
    y: Metres
    radius: Length
    start: Radians
    sweep: Annotated[float, Meta(gt=0.0, le=math.pi + 1e-9)]

    @property
    def middle(self) -> Vector:
        """The point half-way between the edges, at 0.6 of the radius."""
        return self._at(0.6 * self.radius, self.start + self.sweep / 2)

    @property
    def bounds(self) -> Bounds:
        """The axis-aligned rectangle around it, with the points where the arc is farthest out."""
        points = [(self.x, self.y), self._at(self.radius, self.start), self._at(self.radius, self.start + self.sweep)]
        points += [
            self._at(self.radius, quarter)
            for quarter in (0.0, math.pi / 2, math.pi, 3 * math.pi / 2)
            if (quarter - self.start) % math.tau <= self.sweep
        ]
        xs, ys = [x for x, _ in points], [y for _, y in points]
        return min(xs), min(ys), max(xs), max(ys)

    def contains(self, x: float, y: float) -> bool:
        """True if the point is inside or on the border."""
        dx, dy = x - self.x, y - self.y
        return math.hypot(dx, dy) <= self.radius and all(nx * dx + ny * dy >= -_EPS for nx, ny in self._normals())

    def inside(self, start: Vector, end: Vector) -> tuple[float, float] | None:
        """The stretch that is inside: the part in the disc that is also on the inner side of both edges."""
        stretch = disc_part(start, end, (self.x, self.y), self.radius)
        planes = [(nx, ny, nx * self.x + ny * self.y) for nx, ny in self._normals()]
        return some(on_inner_sides(start, end, planes, stretch))

    def nearest(self, x: float, y: float) -> Vector:
        """The point itself if it is inside, or the nearest point of the arc or of an edge."""
        if self.contains(x, y):
            return x, y
        bearing = atan2(y - self.y, x - self.x)
        candidates = [
            nearest_on_segment((x, y), (self.x, self.y), self._at(self.radius, edge))
            for edge in (self.start, self.start + self.sweep)
        ]
        if (bearing - self.start) % math.tau <= self.sweep:
            candidates.append(self._at(self.radius, bearing))
        return min(candidates, key=lambda point: math.dist(point, (x, y)))

    def shrunk(self, margin: float) -> "Polygon":
        """A polygon, because a sector whose border is moved inwards is no sector any more."""
        return Polygon(tuple(self.outline()), z_min=self.z_min, z_max=self.z_max).shrunk(margin)

    def outline(self) -> list[Vector]:
        """The corner, then points of the arc."""
        return [(self.x, self.y), *arc((self.x, self.y), self.radius, self.start, self.sweep)]

    def _at(self, distance: float, bearing: float) -> Vector:
        return ahead(self.x, self.y, bearing, distance)

    def _normals(self) -> tuple[Vector, Vector]:
        """The unit vectors that are perpendicular to the two edges and lead inwards."""
        (c0, s0), (c1, s1) = cos_sin(self.start), cos_sin(self.start + self.sweep)
        return (-s0, c0), (s1, -c1)


class Polygon(_Shape, frozen=True, tag="polygon"):
    """A convex polygon.

    Args:
        points: its corners (x, y), counter-clockwise, at least three, m.
    """

    points: Annotated[tuple[tuple[Metres, Metres], ...], Meta(min_length=3, max_length=1000)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not convex(self.points):
            raise ValueError("expected the corners of a convex polygon, counter-clockwise")

    def contains(self, x: float, y: float) -> bool:
        """True if the point is inside or on the border."""
        return all(nx * x + ny * y >= offset - _EPS for nx, ny, offset in _planes(self.points))

    def inside(self, start: Vector, end: Vector) -> tuple[float, float] | None:
        """The stretch that is inside, by Cyrus and Beck's clipping."""
        return some(on_inner_sides(start, end, _planes(self.points), (0.0, 1.0)))

    def nearest(self, x: float, y: float) -> Vector:
        """The point itself if it is inside, or the nearest point of the border."""
        if self.contains(x, y):
            return x, y
        edges = zip(self.points, turned(self.points), strict=True)
        return min((nearest_on_segment((x, y), a, b) for a, b in edges), key=lambda p: math.dist(p, (x, y)))

    def shrunk(self, margin: float) -> "Polygon":
        """The part that is at least `margin` m from every side, or a tiny triangle about the middle."""
        corners = list(self.points)
        for nx, ny, offset in _planes(self.points):
            corners = clipped(corners, nx, ny, offset + margin)
        if len(corners) < 3 or area(corners) < _EPS:
            x, y = centroid(self.points)
            corners = [(x, y), (x + 1e-6, y), (x, y + 1e-6)]
        return replace(self, points=tuple(corners))

    def outline(self) -> list[Vector]:
        """The corners, counter-clockwise."""
        return list(self.points)

    @property
    def middle(self) -> Vector:
        """The mean of the corners."""
        return centroid(self.points)


@lru_cache(maxsize=256)
def _planes(corners: tuple[Vector, ...]) -> list[tuple[float, float, float]]:
    """For each side of a convex polygon its inward unit normal and its offset.

    A point is inside if nx x + ny y >= offset for all. Walls are asked for theirs again and again.
    """
    planes = []
    for (ax, ay), (bx, by) in zip(corners, turned(corners), strict=True):
        length = math.hypot(bx - ax, by - ay)
        if length > 0.0:
            nx, ny = (ay - by) / length, (bx - ax) / length
            planes.append((nx, ny, nx * ax + ny * ay))
    return planes


Region = Rectangle | Circle | Sector | Polygon
"""A region of any of the four shapes."""


def touch(first: Region, second: Region) -> bool:
    """True if two regions have a point in common. Of two sectors, one counts as its outline."""
    if isinstance(second, Circle) or isinstance(first, Sector):
        first, second = second, first
    if isinstance(first, Circle):
        return second.distance(first.x, first.y) <= first.radius
    a, b = first.outline(), second.outline()
    if any(first.contains(*corner) for corner in b) or any(second.contains(*corner) for corner in a):
        return True
    return any(second.inside(*side) is not None for side in zip(a, turned(a), strict=True))
