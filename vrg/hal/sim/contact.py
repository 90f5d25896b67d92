"""The contacts of discs and convex outlines in the plane: where they touch, along which normal, and how deeply.

Two outlines that overlap have up to two points of contact: the ends of the incident edge of one, clipped to the
reference edge of the other (E. Catto, "Contact manifolds", Game Developers Conference 2007). So a box that is pushed
flat stays flat.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from vrg.portable.scalars import cos_sin, hypot
from vrg.segments import turned
from vrg.types import Vector


class Form(NamedTuple):
    """The form of a body in its own frame.

    Args:
        corners: of a convex outline, counter-clockwise, m; none of a disc.
        radius: of the disc, or of the circle around the outline about the body's origin, m.
        normals: the outward unit normal of the edge that begins at each corner.
    """

    corners: tuple[Vector, ...]
    radius: float
    normals: tuple[Vector, ...] = ()


def moments(corners: Sequence[Vector]) -> tuple[float, Vector, float]:
    """The area of a convex outline in m^2, its centre in m, and the square of its radius of gyration about that, m^2.

    They are sums over the triangles from the origin to each edge.
    """
    area = x = y = second = 0.0
    for (px, py), (qx, qy) in zip(corners, turned(corners), strict=True):
        twice = px * qy - qx * py
        area += twice / 2
        x += twice * (px + qx) / 6
        y += twice * (py + qy) / 6
        second += twice * (px * px + px * qx + qx * qx + py * py + py * qy + qy * qy) / 12
    x, y = x / area, y / area
    return area, (x, y), second / area - x * x - y * y


class Placed(NamedTuple):
    """A form in the map's frame: the origin of the body, and the corners and the normals of its outline, m."""

    x: float
    y: float
    corners: Sequence[Vector]
    radius: float
    normals: Sequence[Vector] = ()


class Contact(NamedTuple):
    """One point at which body `a` touches body `b`.

    Args:
        x, y: the point, m. nx, ny: the unit normal, from `b` to `a`. depth: how far the two overlap there, m.
    """

    x: float
    y: float
    nx: float
    ny: float
    depth: float


def form_of(radius: float, corners: Sequence[Vector]) -> Form:
    """The form of a disc with a radius, m, or else of a convex outline with corners, counter-clockwise, m."""
    if radius:
        return Form((), radius)
    edges = zip(corners, turned(corners), strict=True)
    return Form(tuple(corners), max(hypot(x, y) for x, y in corners), tuple(_normal(*p, *q) for p, q in edges))


def rectangle(length: float, width: float) -> Form:
    """The form of a rectangle about its middle, m."""
    u, v = length / 2, width / 2
    return form_of(0.0, ((u, v), (-u, v), (-u, -v), (u, -v)))


def placed(form: Form, x: float, y: float, heading: float) -> Placed:
    """A form at a pose, m and rad."""
    if not form.corners:
        return Placed(x, y, (), form.radius)
    c, s = cos_sin(heading)
    corners = [(x + c * u - s * v, y + s * u + c * v) for u, v in form.corners]
    return Placed(x, y, corners, form.radius, [(c * u - s * v, s * u + c * v) for u, v in form.normals])


def contacts(a: Placed, b: Placed) -> list[Contact]:
    """The points at which two forms overlap; none if they do not."""
    dx, dy, reach = a.x - b.x, a.y - b.y, a.radius + b.radius
    if dx * dx + dy * dy >= reach * reach:
        return []
    if a.corners and b.corners:
        return _outlines(a, b)
    if a.corners:
        return [Contact(c.x, c.y, -c.nx, -c.ny, c.depth) for c in contacts(b, a)]
    if b.corners:
        return _disc_and_outline(a, b)
    distance = hypot(dx, dy)
    nx, ny = (dx / distance, dy / distance) if distance else (1.0, 0.0)
    return [Contact(b.x + nx * b.radius, b.y + ny * b.radius, nx, ny, reach - distance)]


def _disc_and_outline(a: Placed, b: Placed) -> list[Contact]:
    """The contact of a disc with an outline: with its nearest edge, or with a corner."""
    distance, edge = _farthest_edge(b, ((a.x, a.y),), a.radius)
    if distance >= a.radius:
        return []
    corners, (nx, ny) = b.corners, b.normals[edge]
    (px, py), (qx, qy) = corners[edge], corners[(edge + 1) % len(corners)]
    if distance > 0.0:
        end = None
        if (a.x - px) * -ny + (a.y - py) * nx < 0.0:
            end = px, py
        elif (a.x - qx) * -ny + (a.y - qy) * nx > 0.0:
            end = qx, qy
        if end is not None:
            dx, dy = a.x - end[0], a.y - end[1]
            away = hypot(dx, dy)
            return [Contact(*end, dx / away, dy / away, a.radius - away)] if away < a.radius else []
    return [Contact(a.x - nx * distance, a.y - ny * distance, nx, ny, a.radius - distance)]


def _outlines(a: Placed, b: Placed) -> list[Contact]:
    """The contacts of two outlines along the axis along which they overlap least."""
    of_b, edge_b = _farthest_edge(b, a.corners, 0.0)
    if of_b >= 0.0:
        return []
    of_a, edge_a = _farthest_edge(a, b.corners, 0.0)
    if of_a >= 0.0:
        return []
    # Of two edges that are equally good but for rounding, that of `b` counts in every step.
    if of_b >= of_a - 1e-9:
        return _clipped(b, edge_b, a, 1.0)
    return _clipped(a, edge_a, b, -1.0)


def _farthest_edge(outline: Placed, points: Sequence[Vector], enough: float) -> tuple[float, int]:
    """The edge of an outline in front of which all points are, as far as possible: that distance in m, and its number.

    The distance is negative if a point is behind each edge. From `enough` on, m, another one may be farther.
    """
    best, found = -math.inf, 0
    for number, ((px, py), (nx, ny)) in enumerate(zip(outline.corners, outline.normals, strict=True)):
        offset, least = px * nx + py * ny, math.inf
        for x, y in points:
            along = x * nx + y * ny
            least = min(least, along)
        if least - offset > best:
            best, found = least - offset, number
            if best >= enough:
                break
    return best, found


def _clipped(reference: Placed, edge: int, other: Placed, side: float) -> list[Contact]:
    """The contacts at an edge of the reference: the facing edge of the other outline, as far as it is beside it.

    Args:
        side: 1 if the normal of the contacts is that of the edge, -1 if it is the opposite one.
    """
    corners, (nx, ny) = reference.corners, reference.normals[edge]
    (px, py), (qx, qy) = corners[edge], corners[(edge + 1) % len(corners)]
    products = [mx * nx + my * ny for mx, my in other.normals]
    facing = products.index(min(products))
    first, second = other.corners[facing], other.corners[(facing + 1) % len(other.corners)]
    length = (qx - px) * -ny + (qy - py) * nx
    found = []
    (ua, da), (ub, db) = (((x - px) * -ny + (y - py) * nx, (x - px) * nx + (y - py) * ny) for x, y in (first, second))
    for u, d, v, e in ((ua, da, ub, db), (ub, db, ua, da)):
        at, gap = min(max(u, 0.0), length), d
        if at != u:  # this end is beside the edge: where the other edge passes the edge's end counts
            if u == v or min(max(v, 0.0), length) == at:
                continue
            gap = d + (e - d) * (at - u) / (v - u)
        if gap < 0.0:
            found.append(Contact(px - at * ny + gap * nx, py + at * nx + gap * ny, side * nx, side * ny, -gap))
    return found


def _normal(px: float, py: float, qx: float, qy: float) -> Vector:
    """The outward unit normal of an edge of a counter-clockwise outline."""
    dx, dy = qx - px, qy - py
    length = hypot(dx, dy)
    return dy / length, -dx / length
