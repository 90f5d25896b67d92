"""Scenes of walls and boxes, and what a laser sees of them: a plain ray caster that shares no code with VRG."""

import math
from collections.abc import Sequence

import numpy as np

from vrg.agents.perception.scan import Floats, Scan, make_scan
from vrg.bus.messages import Sighting
from vrg.types import Pose, Vector

ATRV_JR = (0.78, 0.64)
"""The length and width of the body of an ATRV-Jr, m."""
RADIUS = math.hypot(*ATRV_JR) / 2
"""The radius of the circle around it, m."""
HALF_TURN, FULL_TURN = (181, math.radians(-90.0)), (360, math.radians(-180.0))
"""The number of beams, one degree apart, and the angle of the first one, rad."""


def chain(corners: Sequence[Vector], *, closed: bool = True) -> Floats:
    """The sides between corners: shape (n, 4), m."""
    ends = [*corners[1:], corners[0]] if closed else corners[1:]
    return np.array([[*a, *b] for a, b in zip(corners, ends, strict=False)])


def room(x_min: float, y_min: float, x_max: float, y_max: float) -> Floats:
    return chain([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def box(x: float, y: float, heading: float = 0.0, size: Vector = ATRV_JR) -> Floats:
    c, s, a, b = math.cos(heading), math.sin(heading), size[0] / 2, size[1] / 2
    return chain([(x + c * u - s * v, y + s * u + c * v) for u, v in ((a, b), (-a, b), (-a, -b), (a, -b))])


def covariance_of(sighting: Sighting) -> Floats:
    return np.array([[sighting.xx, sighting.xy], [sighting.xy, sighting.yy]])


def together(*parts: Floats) -> Floats:
    return np.concatenate(parts)


def ranges_in(scene: Floats, pose: Pose, beams: int, first: float, range_max: float) -> Floats:
    """The distance along each beam, one degree apart, to the nearest side: shape (beams,), m."""
    bearings = pose.theta + first + np.radians(np.arange(beams))
    dx, dy = np.cos(bearings)[:, None], np.sin(bearings)[:, None]
    ax, ay, bx, by = scene.T
    ex, ey, fx, fy = bx - ax, by - ay, ax - pose.x, ay - pose.y
    with np.errstate(divide="ignore", invalid="ignore"):
        across = dx * ey - dy * ex
        along = (fx * ey - fy * ex) / across
        share = (fx * dy - fy * dx) / across
        met = (along > 0) & (share >= -1e-12) & (share <= 1 + 1e-12)
    return np.minimum(np.where(met, along, np.inf).min(axis=1, initial=np.inf), range_max)


def look(
    scene: Floats,
    pose: Pose,
    *,
    believed: Pose | None = None,
    fan: tuple[int, float] = HALF_TURN,
    range_max: float = 8.0,
    noise: Floats | float = 0.0,
) -> Scan:
    """The scan of a laser at `pose`, put on the map from where it is believed to be."""
    beams, first = fan
    ranges = ranges_in(scene, pose, beams, first, range_max)
    ranges = np.where(ranges < range_max, ranges + noise, ranges)
    return make_scan(
        ranges, believed or pose, mount=0.0, angle_min=first, angle_step=math.radians(1.0), range_max=range_max
    )
