"""Oriented boxes in the plane: their outlines, and their overlap with and distance from other boxes and circles."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vrg.geometry import corners, separation
from vrg.portable.arrays import cos_sin_array
from vrg.portable.scalars import cos_sin, hypot
from vrg.regions import Circle
from vrg.types import Pose, Vector


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle: centre (m), heading of its length (rad), length and width (m).

    Args:
        z_max: the height to which it reaches, m; None if it has no upper end.
    """

    x: float
    y: float
    heading: float
    length: float
    width: float
    z_max: float | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """The gap between a box and another shape.

    Args:
        distance: the distance of the two along the normal, m; negative if they overlap by that much. For boxes that
            are apart corner to corner it is a lower bound.
        nx, ny: the unit normal from the other shape towards the box. Moving an overlapping box by -distance along it
            separates the two.
        x, y: the point where the two touch or come nearest, m: of the box, or a corner of the other box in its side.
    """

    distance: float
    nx: float
    ny: float
    x: float
    y: float


Outline = tuple[float, float, float, float, float, float]
"""A box: its centre x, y in m, the cosine and the sine of its heading, and half its length and width in m."""


def outline(box: Box) -> Outline:
    """The outline of a box."""
    return box.x, box.y, *cos_sin(box.heading), box.length / 2, box.width / 2


def apart(first: Outline, second: Outline, distance: float) -> bool:
    """True if the distance of `box_gap` is so large (m) or larger: much faster, mostly where it is."""
    ax, ay, ca, sa, la, wa = first
    bx, by, cb, sb, lb, wb = second
    dx, dy = ax - bx, ay - by
    cos, sin = abs(ca * cb + sa * sb), abs(sa * cb - ca * sb)
    return (
        abs(dx * ca + dy * sa) - (la + lb * cos + wb * sin) >= distance
        or abs(dx * -sa + dy * ca) - (wa + lb * sin + wb * cos) >= distance
        or abs(dx * cb + dy * sb) - (lb + la * cos + wa * sin) >= distance
        or abs(dx * -sb + dy * cb) - (wb + la * sin + wa * cos) >= distance
    )


def box_edges(boxes: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The outlines of boxes.

    Args:
        boxes: shape (n, 5): x, y, heading, length, width, in m and rad.

    Returns:
        shape (4 n, 4): x0 y0 x1 y1 in m, counter-clockwise around each box.
    """
    cos, sin = cos_sin_array(boxes[:, 2])
    ax, ay = cos * boxes[:, 3] / 2, sin * boxes[:, 3] / 2
    bx, by = -sin * boxes[:, 4] / 2, cos * boxes[:, 4] / 2
    along, across = _CORNERS[:, 0], _CORNERS[:, 1]
    corners = np.empty((len(boxes), 4, 2))
    corners[:, :, 0] = boxes[:, 0, None] + ax[:, None] * along + bx[:, None] * across
    corners[:, :, 1] = boxes[:, 1, None] + ay[:, None] * along + by[:, None] * across
    edges = np.empty((len(boxes), 4, 4))
    edges[:, :, :2] = corners
    edges[:, :, 2:] = corners[:, _NEXT]
    return edges.reshape(-1, 4)


_CORNERS = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
_NEXT = np.array([1, 2, 3, 0])


def box_corners(box: Box) -> list[Vector]:
    """The four corners, counter-clockwise from front left, m."""
    return corners(Pose(box.x, box.y, box.heading), box.length, box.width)


def box_gap(a: Box, b: Box) -> Gap:
    """The gap between box `a` and box `b`."""
    first, second = Pose(a.x, a.y, a.heading), Pose(b.x, b.y, b.heading)
    distance, nx, ny = separation(first, second, (a.length, a.width), (b.length, b.width))
    x, y = _support(a, -nx, -ny)
    if not _inside(b, x, y, 0.02):
        # The contact is then a corner of b in a side of a.
        x, y = _support(b, nx, ny)
    return Gap(distance, nx, ny, x, y)


def circle_gap(box: Box, circle: Circle) -> Gap:
    """The gap between a box and a circle."""
    c, s = cos_sin(box.heading)
    dx, dy = circle.x - box.x, circle.y - box.y
    u, v = dx * c + dy * s, -dx * s + dy * c
    hl, hw = box.length / 2, box.width / 2
    pu, pv = min(max(u, -hl), hl), min(max(v, -hw), hw)
    if (pu, pv) != (u, v):
        distance = hypot(u - pu, v - pv)
        nu, nv = (pu - u) / distance, (pv - v) / distance
        distance -= circle.radius
    # Otherwise the circle's centre is inside the box, and the shortest way out is through the nearest side.
    elif hl - abs(u) < hw - abs(v):
        nu, nv, distance = (-1.0 if u >= 0 else 1.0), 0.0, abs(u) - hl - circle.radius
        pu = -nu * hl
    else:
        nu, nv, distance = 0.0, (-1.0 if v >= 0 else 1.0), abs(v) - hw - circle.radius
        pv = -nv * hw
    return Gap(distance, nu * c - nv * s, nu * s + nv * c, box.x + pu * c - pv * s, box.y + pu * s + pv * c)


def boxes_touch(a: Box, b: Box) -> bool:
    """True if two boxes overlap."""
    return box_gap(a, b).distance < 0.0


def circle_touches(box: Box, circle: Circle) -> bool:
    """True if a box and a circle overlap."""
    return circle_gap(box, circle).distance < 0.0


def body_box(pose: Pose, length: float, width: float) -> Box:
    """The footprint of a body of this size (m) at a pose."""
    return Box(pose.x, pose.y, pose.theta, length, width)


def _support(box: Box, ux: float, uy: float) -> tuple[float, float]:
    """The corner that is farthest in a direction; the middle of the side where two are about equally far."""
    c, s = cos_sin(box.heading)
    along, across = ux * c + uy * s, -ux * s + uy * c
    u = math.copysign(box.length / 2, along) if abs(along) > 0.02 else 0.0
    v = math.copysign(box.width / 2, across) if abs(across) > 0.02 else 0.0
    return box.x + u * c - v * s, box.y + u * s + v * c


def _inside(box: Box, x: float, y: float, margin: float) -> bool:
    c, s = cos_sin(box.heading)
    dx, dy = x - box.x, y - box.y
    return abs(dx * c + dy * s) <= box.length / 2 + margin and abs(-dx * s + dy * c) <= box.width / 2 + margin
