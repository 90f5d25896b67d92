"""From unusual returns to sightings of robots."""

import math

import numpy as np
import numpy.typing as npt

from vrg.agents.perception.scan import Floats, Mask, Scan
from vrg.bus.messages import CORRELATION, VARIANCE_LIMIT, Sighting
from vrg.portable.arrays import hypot
from vrg.portable.scalars import cos_sin, square, total
from vrg.types import Uncertainty

BREAKPOINT_DISTANCE = 0.4
"""The distance in m between two neighbouring returns beyond which they belong to different robots."""
FEWEST = 2
"""The number of returns in the smallest cluster."""
WIDEST = 1.6
"""The extent in m of the largest cluster that can be one robot."""
BODY_ERROR = 0.06
"""The standard deviation in m of the distance between a robot's centre and where its visible side suggests it."""
HEADING_ERROR = 0.01
"""The standard deviation of the heading from which a scan is put on the map, rad."""
HALF_WIDTH = 0.9
"""Half the width of a robot as it is seen, in radii of the circle around it: the mean over all sides of a box."""
CUT_ERROR = 0.1
"""The standard deviation in m, to all sides, that a robot has in addition if a part of it is hidden."""

Beams = npt.NDArray[np.int64]
"""The numbers of neighbouring beams, rising. In a scan of a full turn they go on beyond the last beam: n is beam 0."""


def clusters(scan: Scan, chosen: Mask, explained: Mask | None = None) -> list[Beams]:
    """The groups of chosen returns that are near one another.

    Returns belong together if they are neighbours among the chosen ones and at most BREAKPOINT_DISTANCE apart. Groups
    of fewer than FEWEST returns, and those that are wider than WIDEST, are left out: they are no robots.

    A group is then completed by the returns beside it that are at most BREAKPOINT_DISTANCE from its ends, also if they
    are not chosen: of a robot that comes from an unknown place, only the part in front is unusual. If that makes it
    wider than WIDEST, the robot is beside something else, and the group stays as it was. No return is in two groups.

    Args:
        chosen: shape (beams,). explained: the returns of known robots, which complete no group: shape (beams,).

    Raises:
        ValueError: a mask has not one entry for each beam.
    """
    explained = np.zeros_like(chosen) if explained is None else explained
    for mask in (chosen, explained):
        if mask.shape != scan.ranges.shape:
            raise ValueError(f"expected a mask of shape {scan.ranges.shape}, got {mask.shape}")
    beams = np.flatnonzero(chosen & scan.hits)
    if not beams.size:
        return []
    points = scan.points
    if scan.full_turn:
        beams = _begun_at_a_gap(beams, points)
    apart = hypot(*np.diff(points[beams % len(points)], axis=0).T)
    found: list[Beams] = []
    for group in np.split(beams, np.flatnonzero(apart > BREAKPOINT_DISTANCE) + 1):
        if len(group) < FEWEST or _extent(points[group % len(points)]) > WIDEST:
            continue
        whole = _completed(scan, group, explained)
        best = whole if _extent(points[whole % len(points)]) <= WIDEST else group
        if not any(np.isin(best % len(points), other % len(points)).any() for other in found):
            found.append(best)
    return found


def _begun_at_a_gap(beams: Beams, points: Floats) -> Beams:
    """The beams of a full turn in an order in which no group is across the end, if there is a gap at all."""
    places = points[beams]
    before = hypot(*(places - np.roll(places, 1, axis=0)).T)
    gaps = np.flatnonzero(before > BREAKPOINT_DISTANCE)
    if not gaps.size:
        return beams
    start = int(gaps[0])
    return np.concatenate((beams[start:], beams[:start] + len(points)))


def _extent(points: Floats) -> float:
    """The diagonal of the box around points, shape (n, 2), m."""
    return float(hypot(*(points.max(axis=0) - points.min(axis=0))))


def _completed(scan: Scan, group: Beams, explained: Mask) -> Beams:
    """The group with all returns beside it, each at most BREAKPOINT_DISTANCE from the one before."""
    count, points = len(scan.ranges), scan.points
    free = scan.hits & ~explained
    ends = []
    for beam, step in ((int(group[0]), -1), (int(group[-1]), 1)):
        end = beam
        while abs(end - beam) < count:
            after = end + step
            if not scan.full_turn and not 0 <= after < count:
                break
            if not free[after % count] or math.dist(points[end % count], points[after % count]) > BREAKPOINT_DISTANCE:
                break
            end = after
        ends.append(end)
    return np.concatenate((np.arange(ends[0], group[0]), group, np.arange(group[-1] + 1, ends[1] + 1)))


def sighting_of(
    scan: Scan, beams: Beams, *, radius: float, time: float, uncertainty: Uncertainty | None = None
) -> Sighting:
    """The robot that a cluster of returns is of.

    The returns are of the side that faces the laser. The centre is taken to be in the middle of their bearings, behind
    their mean range by 0.6 of the body's radius: a robot's body is a box, and this is between the 0.7 for a side that
    is seen straight on and the 0.5 for a corner. If the body goes on where the laser cannot see it, at the end of what
    it sweeps or behind something nearer, the centre is taken to be HALF_WIDTH from the end that is seen.

    Args:
        beams: as `clusters` gives them, at least one. radius: of the circle around the robot's body, m.
        time: the match time of the scan, s.
        uncertainty: how well the pose is known from which the scan was put on the map, as in `View.uncertainty`; it is
            added to the covariance. None is a pose without error, and a heading with HEADING_ERROR.

    Raises:
        ValueError: there is no beam, or one of them met nothing.
    """
    if not len(beams) or not np.isfinite(scan.ranges[beams % len(scan.ranges)]).all():
        raise ValueError(f"expected beams that met something, got the beams {beams.tolist()}")
    away = total(scan.ranges[beams % len(scan.ranges)].tolist()) / len(beams) + 0.6 * radius
    first, last = int(beams[0]), int(beams[-1])
    bearing = scan.heading + scan.angle_min + scan.angle_step * (first + last) / 2
    heading = square(HEADING_ERROR) if uncertainty is None else uncertainty.heading
    along = square(BODY_ERROR)
    aside = square(BODY_ERROR / 2) + square(away) * (heading + square(scan.angle_step / 2))
    cut = _goes_on(scan, last, 1) - _goes_on(scan, first, -1)
    hidden = HALF_WIDTH * radius - away * scan.angle_step * (last - first) / 2
    if cut and hidden > 0.0:
        bearing += cut * hidden / away
        along, aside = along + square(CUT_ERROR), aside + square(CUT_ERROR)
    c, s = cos_sin(bearing)
    xx, xy, yy = along * c * c + aside * s * s, (along - aside) * c * s, along * s * s + aside * c * c
    if uncertainty is not None:
        xx, xy, yy = _sendable(xx + uncertainty.xx, xy + uncertainty.xy, yy + uncertainty.yy)
    return Sighting(x=scan.origin[0] + away * c, y=scan.origin[1] + away * s, time=time, xx=xx, xy=xy, yy=yy)


def _goes_on(scan: Scan, end: int, step: int) -> bool:
    """True if a body may go on beyond its last return where the laser does not see it.

    Args:
        end: the beam of that return. step: 1 or -1, the direction away from the body.
    """
    count, after = len(scan.ranges), end + step
    if not scan.full_turn and not 0 <= after < count:
        return True
    return bool(scan.ranges[after % count] < scan.ranges[end % count] - BREAKPOINT_DISTANCE)


def _sendable(xx: float, xy: float, yy: float) -> tuple[float, float, float]:
    """A covariance within the bounds of messages, m^2: that of a robot that is lost may be beyond."""
    xx, yy = min(xx, VARIANCE_LIMIT), min(yy, VARIANCE_LIMIT)
    most = 0.99 * CORRELATION * math.sqrt(xx * yy)
    return xx, min(max(xy, -most), most), yy
