"""From unusual returns to sightings of robots."""

import math

import numpy as np
import numpy.typing as npt

from vrg.agents.perception.scan import Floats, Mask, Scan
from vrg.bus.messages import Sighting

GAP = 0.4
"""The distance in m between two neighbouring returns beyond which they belong to different robots."""
FEWEST = 2
"""The number of returns in the smallest cluster."""
WIDEST = 1.6
"""The extent in m of the largest cluster that can be one robot."""
BODY_ERROR = 0.1
"""The standard deviation in m of the distance between a robot's centre and where its visible side suggests it."""
HEADING_ERROR = 0.01
"""The standard deviation of the heading from which a scan is put on the map, rad."""


def clusters(scan: Scan, chosen: Mask) -> list[npt.NDArray[np.int64]]:
    """The groups of chosen returns that are near one another, each as the rising numbers of its beams.

    Returns belong together if they are neighbours among the chosen ones and at most GAP apart. Groups of fewer than
    FEWEST returns, and those that are wider than WIDEST, are left out: they are no robots.

    A group is then completed by the returns beside it that are at most GAP from its ends, also if they are not chosen:
    of a robot that comes from a place of which nothing is known, only the part in front is unusual. If that makes it
    wider than WIDEST, the robot is beside something else, and the group stays as it was.

    Args:
        chosen: shape (beams,).

    Raises:
        ValueError: `chosen` has not one entry for each beam.
    """
    if chosen.shape != scan.ranges.shape:
        raise ValueError(f"expected a mask of shape {scan.ranges.shape}, got {chosen.shape}")
    beams = np.flatnonzero(chosen & scan.hits)
    if not beams.size:
        return []
    points = scan.points[beams]
    breaks = np.flatnonzero(np.hypot(*np.diff(points, axis=0).T) > GAP) + 1
    found = []
    for group, places in zip(np.split(beams, breaks), np.split(points, breaks), strict=True):
        if len(group) >= FEWEST and _extent(places) <= WIDEST:
            whole = _completed(scan, group)
            found.append(whole if _extent(scan.points[whole]) <= WIDEST else group)
    return found


def _extent(points: Floats) -> float:
    """The diagonal of the box around points, shape (n, 2), m."""
    return float(np.hypot(*(points.max(axis=0) - points.min(axis=0))))


def _completed(scan: Scan, group: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The group with all returns beside it, each at most GAP from the one before."""
    points, hits = scan.points, scan.hits
    ends = []
    for beam, step in ((int(group[0]), -1), (int(group[-1]), 1)):
        end = beam
        while 0 <= end + step < len(hits) and hits[end + step]:
            if math.dist(points[end], points[end + step]) > GAP:
                break
            end += step
        ends.append(end)
    return np.unique(np.concatenate((group, np.arange(ends[0], group[0]), np.arange(group[-1] + 1, ends[1] + 1))))


def sighting_of(scan: Scan, beams: npt.NDArray[np.int64], *, radius: float, time: float) -> Sighting:
    """The robot that a cluster of returns is of.

    The returns are of the side that faces the laser. The centre is taken to be in the middle of their bearings, behind
    their mean range by 0.6 of the body's radius: a robot's body is a box, and this is between the 0.7 for a side that
    is seen straight on and the 0.5 for a corner.

    Args:
        beams: the numbers of the beams, at least one, rising. radius: of the circle around the robot's body, m.
        time: the match time of the scan, s.
    """
    away = float(np.mean(scan.ranges[beams])) + 0.6 * radius
    bearing = scan.heading + scan.angle_min + scan.angle_step * (int(beams[0]) + int(beams[-1])) / 2
    c, s = math.cos(bearing), math.sin(bearing)
    along = BODY_ERROR**2
    aside = (BODY_ERROR / 2) ** 2 + (away * HEADING_ERROR) ** 2 + (away * scan.angle_step / 2) ** 2
    return Sighting(
        x=scan.origin[0] + away * c,
        y=scan.origin[1] + away * s,
        time=time,
        xx=along * c * c + aside * s * s,
        xy=(along - aside) * c * s,
        yy=along * s * s + aside * c * c,
    )
