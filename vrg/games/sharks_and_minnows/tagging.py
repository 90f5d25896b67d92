"""The instant at which two moving bodies first come within a distance. No contact between two ticks is missed."""

import math
from collections.abc import Sequence

from vrg.geometry import circumradius, interpolate, outline_distance, wrap
from vrg.portable.scalars import hypot
from vrg.regions import Bounds
from vrg.segments import in_box
from vrg.types import Pose, Vector

RESOLUTION = 1e-3
"""The shortest relative motion in m between two instants that are looked at."""

SweptBody = tuple[Pose, Pose, Vector]
"""The motion of a body: its pose before, its pose now, and its (length, width) in m."""


def swept(before: Sequence[float], now: Sequence[float], size: Sequence[float], margin: float) -> Bounds:
    """The bounds of all that a body may cover on its way, and `margin` m more on each side.

    Args:
        before, now: its pose (x, y, heading) at the two ends. size: its length and width, m.
    """
    far = circumradius((size[0], size[1])) + margin
    return (
        min(before[0], now[0]) - far,
        min(before[1], now[1]) - far,
        max(before[0], now[0]) + far,
        max(before[1], now[1]) + far,
    )


def first_tag(hunter: SweptBody, prey: SweptBody, reach: float, refuge: Bounds) -> float:
    """The first instant at which the outlines are within `reach` while the prey's centre is outside `refuge`.

    Both bodies are taken to move straight and to turn evenly between their two poses. The method is conservative
    advancement: at distance d the bodies cannot come within `reach` before they have moved d - reach towards each
    other, so that much of the motion can be skipped.

    Args:
        reach: the distance of the outlines, m.

    Returns:
        the instant as a fraction from 0 (before) to 1 (now); infinite if there is no such instant.
    """
    (h0, h1, h_size), (p0, p1, p_size) = hunter, prey
    radii = circumradius(h_size) + circumradius(p_size)
    shift = hypot((h1.x - h0.x) - (p1.x - p0.x), (h1.y - h0.y) - (p1.y - p0.y))
    if hypot(h0.x - p0.x, h0.y - p0.y) - shift > radii + reach:
        return math.inf
    motion = (
        shift
        + abs(wrap(h1.theta - h0.theta)) * circumradius(h_size)
        + abs(wrap(p1.theta - p0.theta)) * circumradius(p_size)
    )
    fraction = 0.0
    # A refuge is convex, so the prey is in it on one stretch of its way only.
    enters, leaves = in_box((p0.x, p0.y), (p1.x, p1.y), refuge)
    while True:
        h, p = interpolate(h0, h1, fraction), interpolate(p0, p1, fraction)
        gap = outline_distance(h, p, h_size, p_size) - reach
        if gap <= 0 and not (refuge[0] <= p.x <= refuge[2] and refuge[1] <= p.y <= refuge[3]):
            return fraction
        inside = enters <= fraction <= leaves
        if fraction >= 1.0 or (motion == 0.0 and not inside):
            return math.inf
        # The border belongs to the refuge: the prey is outside just behind it.
        fraction = min(1.0, leaves + 1e-9 if inside else fraction + max(gap, RESOLUTION) / motion)
