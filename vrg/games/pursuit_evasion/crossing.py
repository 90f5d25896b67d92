"""The motion of an intruder between two instants, and the end of its crossing. Functions of poses alone."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vrg.coordinator.rulebook import Observation
from vrg.geometry import ahead, interpolate
from vrg.portable.scalars import cos_sin, total
from vrg.regions import Region
from vrg.segments import in_disc
from vrg.types import Pose

COURSE_REACH = 0.5
"""The distance in m from the line of its course within which the centre of an intruder stays."""


def across(course: Pose, pose: Pose) -> float:
    """The distance of a body's centre to the left of a course, m."""
    cos, sin = cos_sin(course.theta)
    return (pose.y - course.y) * cos - (pose.x - course.x) * sin


def along(course: Pose, pose: Pose) -> float:
    """The distance in m that a body's centre has come along a course."""
    cos, sin = cos_sin(course.theta)
    return (pose.x - course.x) * cos + (pose.y - course.y) * sin


@dataclass(frozen=True)
class Capture:
    """A capture: by which pursuer, and the poses of both at that instant."""

    pursuer: str
    pursuer_pose: Pose
    intruder_pose: Pose


@dataclass(frozen=True)
class Ends:
    """The events that ended an intruder's crossing between two instants.

    Args:
        inside: it was inside the area. captured: its capture, or None.
        left: its pose where it left the area, or where it is if it has passed by; else None.
    """

    inside: bool = False
    captured: Capture | None = None
    left: Pose | None = None


def ends_of(
    name: str,
    pursuers: Sequence[str],
    before: Observation,
    now: Observation,
    area: Region,
    reach: float,
    *,
    course: float,
    entered: bool,
) -> Ends:
    """Judge the way of an intruder between two instants. All are taken to move straight and evenly.

    Args:
        pursuers: the pursuers that may capture it, in the order in which they win ties.
        reach: the distance of two centres in m below which the intruder is captured.
        course: the direction in which it drives, rad. entered: it has been inside the area before.
    """
    if name not in now.poses:
        return Ends()
    a, b = now.way(name, before)
    start, end = (a.x, a.y), (b.x, b.y)
    stretch = area.inside(start, end)
    inside = stretch is not None
    leaves = None
    # A measured pose may tremble over the border, so who is outside has left only if it does not drive inwards.
    far = total(math.dist(end, corner) for corner in area.outline())
    if not area.contains(*end) and area.inside(end, ahead(b.x, b.y, course, far)) is None:
        leaves = 1.0 if not (entered or inside) else 0.0 if stretch is None else stretch[1]
    captures = {p: at for p in pursuers if (at := _capture(p, a, b, before, now, reach)) is not None}
    first = min(captures, key=lambda p: captures[p], default=None)
    if first is not None and (leaves is None or captures[first] <= leaves):
        at = captures[first]
        there = interpolate(*now.way(first, before), at)
        return Ends(inside, Capture(first, there, interpolate(a, b, at)))
    return Ends(inside, left=None if leaves is None else interpolate(a, b, leaves))


def _capture(pursuer: str, a: Pose, b: Pose, before: Observation, now: Observation, reach: float) -> float | None:
    """The fraction of the way at which the centres of the two first come closer than `reach`, or None."""
    if pursuer not in now.poses:
        return None
    p, q = now.way(pursuer, before)
    start, end = (a.x - p.x, a.y - p.y), (b.x - q.x, b.y - q.y)
    stretch = in_disc(start, end, (0.0, 0.0), reach)
    if stretch is None:
        return None
    # A way that only touches the circle comes as near as `reach`, but not closer.
    middle = (stretch[0] + stretch[1]) / 2
    x, y = start[0] + (end[0] - start[0]) * middle, start[1] + (end[1] - start[1]) * middle
    return stretch[0] if math.hypot(x, y) < reach * (1.0 - 1e-12) else None
