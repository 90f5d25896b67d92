"""Planar ray casting against the outlines of boxes and against circles, and the nearest surface in cones.

The beams of a range finder are evenly spaced, so the beams that meet an edge are neighbours: a run. The run of an edge
follows from the bearings of its two ends. Only those (beam, edge) pairs are intersected: a few per beam, however many
edges there are. Edges are counter-clockwise around solid bodies and are seen from outside only: the far side of a body
is never nearer than its near side, so the sign of one cross product excludes half of the edges.

The distance from the apex of a cone along a straight edge falls up to the foot of the perpendicular and then rises.
So the nearest point of an edge within a cone is the nearest point of the whole edge, if that is in the cone, or else a
point in which the edge crosses a border of the cone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel
from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.contact import Placed
from vrg.hal.sim.shapes import box_edges
from vrg.portable.arrays import cos_sin_array, hypot, turn_order
from vrg.portable.scalars import asin, atan2, cos_sin, tan
from vrg.segments import turned

Floats = npt.NDArray[np.float64]

Thing = tuple[Placed, float]
"""A passive body where it is, and its height in m."""
_EPS = 1e-9


class Edges:
    """The edges of outlines, with the values that every scan needs of them.

    Args:
        segments: shape (n, 4): x0 y0 x1 y1 in m, counter-clockwise around each body.
    """

    __slots__ = ("ends", "normals", "offsets")

    def __init__(self, segments: Floats) -> None:
        self.ends: Floats = np.ascontiguousarray(segments.T)
        """The two ends of each edge: shape (4, n), x0 y0 x1 y1 in m."""
        dx, dy = self.ends[2] - self.ends[0], self.ends[3] - self.ends[1]
        length = hypot(dx, dy)
        self.normals: Floats = np.array((dy / length, -dx / length))
        """The outward unit normal of each edge: shape (2, n)."""
        self.offsets: Floats = self.normals[0] * self.ends[0] + self.normals[1] * self.ends[1]
        """The distance of each edge's line from the origin, along its normal: shape (n,), m."""

    def join(self, others: "Edges") -> "Edges":
        """Return these edges and others together."""
        joined = Edges.__new__(Edges)
        joined.ends = np.concatenate((self.ends, others.ends), axis=1)
        joined.normals = np.concatenate((self.normals, others.normals), axis=1)
        joined.offsets = np.concatenate((self.offsets, others.offsets))
        return joined


def among_robots(walls: Edges, models: Sequence[RobotModel], poses: Floats) -> Edges:
    """The edges of walls together with those of all robots.

    Args:
        models: the models of the robots. poses: theirs, shape (robots, 3), m and rad.
    """
    sizes = np.array([m.size for m in models], dtype=np.float64).reshape(-1, 2)
    if kernel is None:
        return walls.join(Edges(box_edges(np.concatenate((poses, sizes), axis=1))))
    own, count = Edges.__new__(Edges), 4 * len(models)
    own.ends, own.normals, own.offsets = np.empty((4, count)), np.empty((2, count)), np.empty(count)
    kernel.outlines(np.ascontiguousarray(poses), sizes, own.ends, own.normals, own.offsets)
    return walls.join(own)


def among_things(edges: Edges, discs: Floats, things: Sequence[Thing], height: float) -> tuple[Edges, Floats]:
    """The edges and the discs together with those of the passive bodies that reach up to a height, m."""
    seen = [at for at, tall in things if tall >= height]
    sides = [(*a, *b) for at in seen for a, b in zip(at.corners, turned(at.corners), strict=True)]
    if sides:
        edges = edges.join(Edges(np.array(sides)))
    round_ones = [(at.x, at.y, at.radius) for at in seen if not at.corners]
    return edges, np.concatenate((discs, round_ones)) if round_ones else discs


@dataclass(frozen=True)
class Fan:
    """Evenly spaced beams, within -pi..pi of straight ahead.

    Args:
        first: the angle of the first beam in the sensor's frame, rad. step: the angle between beams, rad.
        count: the number of beams.
        angles: the beams' angles, derived from the above: shape (count,), rad.
        directions: the cosines and sines of the angles: shape (2, count).
        order: the directions as numbers that rise with them; see `turn_order`.
    """

    first: float
    step: float
    count: int
    angles: Floats = field(init=False, repr=False, compare=False)
    directions: Floats = field(init=False, repr=False, compare=False)
    order: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        angles = self.first + self.step * np.arange(self.count, dtype=np.float64)
        angles = np.clip(angles, -math.pi, math.pi)  # rounding must not lead beyond straight behind
        object.__setattr__(self, "angles", angles)
        object.__setattr__(self, "directions", np.array(cos_sin_array(angles)))
        object.__setattr__(self, "order", turn_order(*self.directions))

    @staticmethod
    @cache
    def of(beams: int, fov: float) -> "Fan":
        """The beams that cover `fov` (rad) symmetrically about straight ahead, both ends included.

        A single beam is straight ahead.
        """
        if beams == 1:
            return Fan(0.0, fov, 1)
        return Fan(-fov / 2, fov / (beams - 1), beams)


def cast(x: float, y: float, heading: float, fan: Fan, range_max: float, edges: Edges, discs: Floats) -> Floats:
    """The distance along each beam of one sensor to the nearest body: shape (fan.count,), m. See `cast_all`."""
    turns = np.array(cos_sin(heading))[:, None]
    ranges: Floats = cast_all(np.array(((x, y),)), turns, fan, range_max, edges, discs)[0]
    return ranges


def cast_all(places: Floats, turns: Floats, fan: Fan, range_max: float, edges: Edges, discs: Floats) -> Floats:
    """The distance along each beam of each sensor to the nearest body.

    Args:
        places: of the sensors in the map's frame: shape (sensors, 2), m.
        turns: the cosines and the sines of their headings: shape (2, sensors).
        range_max: the range in m of a beam that meets nothing nearer.
        edges: outlines of bodies. A body is not seen from inside, so a robot never sees itself.
        discs: shape (n, 3): x, y and radius of round bodies, m.

    Returns:
        shape (sensors, fan.count), m.
    """
    # Beams are compared by 1 / range. It is linear in a beam's direction, so the pairs need no divisions.
    inverse = np.full(len(places) * fan.count, 1.0 / range_max)
    if kernel is None:
        _cast_edges(inverse, places, turns, fan, range_max, edges)
    else:
        kernel.cast_edges(
            range_max, np.ascontiguousarray(places), turns, edges.ends, edges.normals, edges.offsets,
            fan.directions, fan.order, inverse,
        )  # fmt: skip
    ranges: Floats = np.reciprocal(inverse, out=inverse).reshape(len(places), fan.count)
    if len(discs):
        farthest, circles = ranges.max(axis=1).tolist(), discs.tolist()
        for (x, y), (c, s), reach, own in zip(places.tolist(), turns.T.tolist(), farthest, ranges, strict=True):
            _cast_discs(own, x, y, c, s, fan, reach, circles)
    return ranges


def _cast_edges(inverse: Floats, places: Floats, turns: Floats, fan: Fan, range_max: float, edges: Edges) -> None:
    """Raise `inverse`, 1 / range of all beams of one sensor after the other, where an edge is nearer."""
    height = places[:, :1] * edges.normals[0] + places[:, 1:] * edges.normals[1]
    height -= edges.offsets
    looks, seen = ((height > _EPS) & (height < range_max)).nonzero()
    if not len(seen):
        return
    height, (x, y), (c, s) = height[looks, seen], places.take(looks, axis=0).T, turns.take(looks, axis=1)
    ends = edges.ends.take(seen, axis=1)
    ends[::2] -= x
    ends[1::2] -= y
    slope_x, slope_y = edges.normals.take(seen, axis=1) / -height
    slopes = np.array((c * slope_x + s * slope_y, c * slope_y - s * slope_x))
    # An outline is counter-clockwise, so from outside an edge runs from its greater bearing to its smaller one.
    xs, ys = ends[::2], ends[1::2]
    high, low = turn_order(c * xs + s * ys, c * ys - s * xs)
    behind = (high < low).nonzero()[0]
    if len(behind):  # these edges cross the line straight behind, where bearings jump, so each has two runs
        slopes = np.concatenate((slopes, slopes[:, behind]), axis=1)
        looks = np.concatenate((looks, looks[behind]))
        low = np.concatenate((low, np.full(len(behind), -2.0)))
        high = np.concatenate((high, high[behind]))
        high[behind] = 2.0
    first = fan.order.searchsorted(low - _EPS)
    counts = fan.order.searchsorted(high + _EPS, side="right")
    counts -= first
    np.maximum(counts, 0, out=counts)
    stops = counts.cumsum()
    beams = np.arange(stops[-1])
    beams += (first - stops + counts).repeat(counts)
    pairs = slopes.repeat(counts, axis=1)
    pairs *= fan.directions.take(beams, axis=1)
    beams += (looks * fan.count).repeat(counts)
    np.maximum.at(inverse, beams, pairs[0] + pairs[1])


def _cast_discs(
    ranges: Floats, x: float, y: float, c: float, s: float, fan: Fan, range_max: float, discs: list[list[float]]
) -> None:
    """Lower `ranges`, of which `range_max` is the longest, where a circle is nearer."""
    for cx, cy, radius in discs:
        dx, dy = cx - x, cy - y
        square = dx * dx + dy * dy
        if square > (range_max + radius) * (range_max + radius) or square <= radius * radius:
            continue
        u, v = dx * c + dy * s, dy * c - dx * s
        bearing, half = atan2(v, u), asin(radius / math.sqrt(square))
        for turn in (0.0, 2 * math.pi, -2 * math.pi):
            first = max(0, math.ceil((bearing - half + turn - fan.first) / fan.step))
            last = min(fan.count - 1, math.floor((bearing + half + turn - fan.first) / fan.step))
            if first <= last:
                run = slice(first, last + 1)
                along = u * fan.directions[0, run] + v * fan.directions[1, run]
                depth = np.maximum(along * along + (radius * radius - square), 0.0)
                np.minimum(ranges[run], along - np.sqrt(depth), out=ranges[run])


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
    nearest, turns = np.full(len(poses), range_max), np.array(cos_sin_array(poses[:, 2]))
    slope = tan(cone / 2)
    if kernel is None:
        _hear_edges(nearest, poses, turns, slope, range_max, edges)
    else:
        kernel.cone_edges(
            range_max, slope, math.hypot(1.0, slope), np.ascontiguousarray(poses), turns,
            edges.ends, edges.normals, edges.offsets, nearest,
        )  # fmt: skip
    if len(discs):
        np.minimum(nearest, _discs(poses[:, :2].T, turns, cone / 2, discs).min(axis=1), out=nearest)
    return nearest


def _hear_edges(nearest: Floats, poses: Floats, turns: Floats, slope: float, range_max: float, edges: Edges) -> None:
    """Lower `nearest` where an edge is nearer; `slope` is the tangent of half of the angle of a cone."""
    # Only those (cone, edge) pairs are looked at closely whose edge faces the apex and is near enough.
    x, y = poses[:, 0, None], poses[:, 1, None]
    height = edges.normals[0] * x + edges.normals[1] * y - edges.offsets
    middle = (edges.ends[:2] + edges.ends[2:]) / 2
    reach = range_max + hypot(edges.ends[2] - edges.ends[0], edges.ends[3] - edges.ends[1]) / 2
    near = hypot(middle[0] - x, middle[1] - y) < reach
    cones, seen = (near & (height > _EPS) & (height < range_max)).nonzero()
    if len(seen):
        places, ends = poses[cones, :2].T, edges.ends.take(seen, axis=1)
        away = _edges(places, turns.take(cones, axis=1), slope, ends)
        np.minimum.at(nearest, cones, away)


def _edges(places: Floats, turns: Floats, slope: float, ends: Floats) -> Floats:
    """The distance to an edge within a cone, infinite where there is none: shape (pairs,), m.

    Args:
        places: of the cones, shape (2, pairs), m. turns: the cosines and sines of their directions: shape (2, pairs).
        slope: the tangent of half of the cone's angle.
        ends: of the edges, shape (4, pairs), x0 y0 x1 y1 in m.
    """
    (x, y), (c, s) = places, turns
    ax, ay = ends[0] - x, ends[1] - y
    ax, ay = ax * c + ay * s, ay * c - ax * s
    bx, by = ends[2] - x, ends[3] - y
    bx, by = bx * c + by * s, by * c - bx * s
    dx, dy = bx - ax, by - ay
    foot = np.clip(-(ax * dx + ay * dy) / (dx * dx + dy * dy), 0.0, 1.0)
    px, py = ax + foot * dx, ay + foot * dy
    found = np.where(np.abs(py) <= slope * px, hypot(px, py), np.inf)
    for border in (slope, -slope):
        # The border is y = border x, x > 0: where the edge crosses it, a + t d fulfils this equation.
        divisor = border * dx - dy
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (ay - border * ax) / divisor
            along = ax + t * dx
            crossing = (t >= 0.0) & (t <= 1.0) & (along > 0.0)
            found = np.where(crossing, np.minimum(found, along * math.hypot(1.0, border)), found)
    return found


def _discs(places: Floats, turns: Floats, half: float, discs: Floats) -> Floats:
    """The distance to each disc within each cone, infinite where there is none: shape (cones, discs), m.

    Args:
        places, turns: as in `_edges`, of all cones. half: half of the angle of each cone, rad.
    """
    (x, y), (c, s) = places[:, :, None], turns[:, :, None]
    dx, dy = discs[:, 0] - x, discs[:, 1] - y
    away = hypot(dx, dy)
    # In the frame of the border of the cone that is nearer to the middle of the disc.
    (cos, sin), u, v = cos_sin(half), c * dx + s * dy, np.abs(c * dy - s * dx)
    along, off = u * cos + v * sin, v * cos - u * sin
    inner = (off <= 0.0) & (u > 0.0)
    found = np.where(inner, away - discs[:, 2], np.inf)
    # Where the middle is outside of the cone, the nearest point in the cone is on that border.
    depth = discs[:, 2] * discs[:, 2] - off * off
    touched = ~inner & (along > 0.0) & (depth >= 0.0)
    found = np.where(touched, along - np.sqrt(np.maximum(depth, 0.0)), found)
    inside = away <= discs[:, 2]
    return np.where(inside, np.inf, found)
