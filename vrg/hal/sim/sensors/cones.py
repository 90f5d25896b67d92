"""The nearest surface within cones, vectorised: what ultrasonic range finders measure.

The distance from the apex of a cone along a straight edge falls up to the foot of the perpendicular and then rises.
So the nearest point of an edge within a cone is the nearest point of the whole edge, if that is in the cone, or else a
point in which the edge crosses a border of the cone.
"""

import math

import numpy as np

from vrg.hal.sim.sensors.rays import Edges, Floats

_EPS = 1e-9


def nearest_in_cones(poses: Floats, cone: float, range_max: float, edges: Edges, discs: Floats) -> Floats:
    """The distance from the apex of each cone to the nearest body in it.

    Args:
        poses: shape (cones, 3): x and y of each apex in m, and the direction of its axis in rad, in the map's frame.
        cone: the whole angle of each cone, rad, less than pi.
        range_max: the distance in m where there is nothing nearer.
        edges: outlines of bodies. A body is not seen from inside, so a robot never hears itself.
        discs: shape (n, 3): x, y and radius of round bodies, m.

    Returns:
        shape (cones,), m.
    """
    nearest = np.full(len(poses), range_max)
    # Only those (cone, edge) pairs are looked at closely whose edge faces the apex and is near enough.
    x, y = poses[:, 0, None], poses[:, 1, None]
    height = edges.normals[0] * x + edges.normals[1] * y - edges.offsets
    middle = (edges.ends[:2] + edges.ends[2:]) / 2
    reach = range_max + np.hypot(edges.ends[2] - edges.ends[0], edges.ends[3] - edges.ends[1]) / 2
    near = (middle[0] - x) ** 2 + (middle[1] - y) ** 2 < reach**2
    cones, seen = (near & (height > _EPS) & (height < range_max)).nonzero()
    if len(seen):
        away = _edges(poses.take(cones, axis=0), math.tan(cone / 2), edges.ends.take(seen, axis=1))
        np.minimum.at(nearest, cones, away)
    if len(discs):
        np.minimum(nearest, _discs(poses, cone / 2, discs).min(axis=1), out=nearest)
    return nearest


def _edges(poses: Floats, slope: float, ends: Floats) -> Floats:
    """The distance to an edge within a cone, infinite where there is none: shape (pairs,), m.

    Args:
        poses: of the cones, shape (pairs, 3). slope: the tangent of half of the cone's angle.
        ends: of the edges, shape (4, pairs), x0 y0 x1 y1 in m.
    """
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    ax, ay = ends[0] - poses[:, 0], ends[1] - poses[:, 1]
    ax, ay = ax * c + ay * s, ay * c - ax * s
    bx, by = ends[2] - poses[:, 0], ends[3] - poses[:, 1]
    bx, by = bx * c + by * s, by * c - bx * s
    dx, dy = bx - ax, by - ay
    foot = np.clip(-(ax * dx + ay * dy) / (dx * dx + dy * dy), 0.0, 1.0)
    px, py = ax + foot * dx, ay + foot * dy
    found = np.where(np.abs(py) <= slope * px, np.hypot(px, py), np.inf)
    for border in (slope, -slope):
        # The border is y = border x, x > 0: where the edge crosses it, a + t d fulfils this equation.
        divisor = border * dx - dy
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (ay - border * ax) / divisor
            along = ax + t * dx
            crossing = (t >= 0.0) & (t <= 1.0) & (along > 0.0)
            found = np.where(crossing, np.minimum(found, along * math.hypot(1.0, border)), found)
    return found


def _discs(poses: Floats, half: float, discs: Floats) -> Floats:
    """The distance to each disc within each cone, infinite where there is none: shape (cones, discs), m."""
    dx, dy = discs[:, 0] - poses[:, 0, None], discs[:, 1] - poses[:, 1, None]
    away = np.hypot(dx, dy)
    bearing = np.abs(np.remainder(np.arctan2(dy, dx) - poses[:, 2, None] + np.pi, 2 * np.pi) - np.pi)
    found = np.where(bearing <= half, away - discs[:, 2], np.inf)
    # Where the middle is outside of the cone, the nearest point in the cone is on the border that is nearer to it.
    off = bearing - half
    depth = discs[:, 2] ** 2 - (away * np.sin(off)) ** 2
    touched = (bearing > half) & (off < np.pi / 2) & (depth >= 0.0)
    border = away * np.cos(off) - np.sqrt(np.maximum(depth, 0.0))
    found = np.where(touched, border, found)
    inside = away <= discs[:, 2]
    return np.where(inside, np.inf, found)
