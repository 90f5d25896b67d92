"""The instant at which two moving bodies first come within a distance. No contact between two ticks is missed."""

import math
from collections.abc import Mapping

from vrg.geometry import circumradius, interpolate, outline_distance, wrap
from vrg.portable.scalars import hypot
from vrg.regions import Bounds
from vrg.segments import in_box
from vrg.types import Pose, Vector

RESOLUTION = 1e-3
"""The shortest relative motion in m between two instants that are looked at."""

SweptBody = tuple[Pose, Pose, Vector]
"""The motion of a body: its pose before, its pose now, and its (length, width) in m."""


class Hunters:
    """Many hunters, of which a prey meets few: only those are looked at closely that might come within reach of it.

    Args:
        motions: the hunters. reach: as for `first_tag`.
    """

    def __init__(self, motions: Mapping[str, SweptBody], reach: float) -> None:
        self._swept = [(name, motion, swept(motion, reach + RESOLUTION)) for name, motion in motions.items()]

    def near(self, prey: SweptBody) -> dict[str, SweptBody]:
        """The hunters that might come within reach of a prey. All others surely do not."""
        x_min, y_min, x_max, y_max = swept(prey, 0.0)
        return {
            name: motion
            for name, motion, box in self._swept
            if box[0] <= x_max and x_min <= box[2] and box[1] <= y_max and y_min <= box[3]
        }


def swept(motion: SweptBody, margin: float) -> Bounds:
    """The bounds of all that a body may cover on its way, and `margin` m more on each side."""
    before, now, size = motion
    far = circumradius(size) + margin
    return (
        min(before.x, now.x) - far,
        min(before.y, now.y) - far,
        max(before.x, now.x) + far,
        max(before.y, now.y) + far,
    )


def first_tags(
    hunters: Mapping[str, SweptBody], prey: SweptBody, reach: float, refuge: Bounds, until: Mapping[str, float]
) -> tuple[float, list[str]] | None:
    """The first instant at which any hunter tags the prey, and all hunters that are within reach at that instant.

    Args:
        reach, refuge: as for `first_tag`.
        until: the fraction of the way up to which each hunter may tag, such as where it leaves the field.

    Returns:
        the instant as a fraction from 0 (before) to 1 (now), and the hunters' names, sorted; None if there is no tag.
    """
    first: dict[str, float] = {}
    for name, hunter in hunters.items():
        fraction = first_tag(hunter, prey, reach, refuge)
        if fraction <= until[name]:
            first[name] = fraction
    if not first:
        return None
    at = min(first.values())
    p0, p1, size = prey
    place = interpolate(p0, p1, at)
    taggers = [
        name
        for name, (h0, h1, own) in hunters.items()
        if first.get(name) == at
        or (at <= until[name] and outline_distance(interpolate(h0, h1, at), place, own, size) <= reach)
    ]
    return at, sorted(taggers)


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
