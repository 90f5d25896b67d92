"""When two moving bodies first come within a distance: nothing tunnels between two ticks."""

import math

from vrg.geometry import circumradius, interpolate, outline_distance, wrap
from vrg.regions import Region
from vrg.types import Pose, Vector

RESOLUTION = 1e-3
"""m of relative motion between two looks where bodies are about to touch the distance."""

Motion = tuple[Pose, Pose, Vector]
"""Pose before, pose now, (length, width)."""


def first_tag(hunter: Motion, prey: Motion, reach: float, refuge: Region) -> float | None:
    """The first instant at which the outlines are within `reach` while the prey's centre is outside `refuge`.

    Both move straight and turn evenly between their two poses. Conservative advancement: from a look at distance d the
    bodies cannot meet before they have moved d - reach towards each other, so the next look can wait that long.

    Returns:
        a fraction from 0 (before) to 1 (now), or None.
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
