"""When two moving bodies first come within a distance. No contact between two ticks is missed."""

import math

from vrg.geometry import circumradius, interpolate, outline_distance, wrap
from vrg.regions import Region
from vrg.types import Pose, Vector

RESOLUTION = 1e-3
"""The shortest relative motion in m between two instants that are looked at."""

Motion = tuple[Pose, Pose, Vector]
"""The motion of a body: its pose before, its pose now, and its (length, width) in m."""


def first_tag(hunter: Motion, prey: Motion, reach: float, refuge: Region) -> float | None:
    """The first instant at which the outlines are within `reach` while the prey's centre is outside `refuge`.

    Both bodies are taken to move straight and to turn evenly between their two poses. The method is conservative
    advancement: at distance d the bodies cannot come within `reach` before they have moved d - reach towards each
    other, so that much of the motion can be skipped.

    Args:
        reach: the distance of the outlines, m.

    Returns:
        the instant as a fraction from 0 (before) to 1 (now), or None if there is no such instant.
    """
    (h0, h1, h_size), (p0, p1, p_size) = hunter, prey
    radii = circumradius(h_size) + circumradius(p_size)
    shift = math.hypot((h1.x - h0.x) - (p1.x - p0.x), (h1.y - h0.y) - (p1.y - p0.y))
    if math.hypot(h0.x - p0.x, h0.y - p0.y) - shift > radii + reach:
        return None
    motion = (
        shift
        + abs(wrap(h1.theta - h0.theta)) * circumradius(h_size)
        + abs(wrap(p1.theta - p0.theta)) * circumradius(p_size)
    )
    fraction = 0.0
    while True:
        h, p = interpolate(h0, h1, fraction), interpolate(p0, p1, fraction)
        gap = outline_distance(h, p, h_size, p_size) - reach
        if gap <= 0 and not refuge.contains(p.x, p.y):
            return fraction
        if fraction >= 1.0 or motion == 0.0:
            return None
        fraction = min(1.0, fraction + max(gap, RESOLUTION) / motion)
