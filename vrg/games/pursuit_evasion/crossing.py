"""How an intruder moves between two instants, and how its crossing ends. Functions of poses alone."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from vrg.bus.messages import Sighting
from vrg.coordinator.rulebook import Field
from vrg.geometry import interpolate
from vrg.regions import Region
from vrg.segments import in_disc
from vrg.types import Pose, Vector


@dataclass(frozen=True)
class Course:
    """The position (m) and the velocity (m/s) of an intruder at one instant."""

    position: Vector
    velocity: Vector

    def distance(self, sighting: Sighting, now: float) -> float:
        """The distance of a sighting from where the intruder was at its time, m.

        Args:
            now: the match time of the position, s.
        """
        age = now - sighting.time
        x, y = self.position[0] - self.velocity[0] * age, self.position[1] - self.velocity[1] * age
        return math.hypot(sighting.x - x, sighting.y - y)


def course_of(name: str, before: Field, now: Field) -> Course | None:
    """How an intruder moves; None if it is not in the world."""
    if name not in now.poses:
        return None
    b = now.poses[name]
    a, dt = before.poses.get(name, b), now.time - before.time
    velocity = ((b.x - a.x) / dt, (b.y - a.y) / dt) if dt > 0 else (0.0, 0.0)
    return Course((b.x, b.y), velocity)


@dataclass(frozen=True)
class Capture:
    """A capture: by which pursuer, and the poses of both at that instant."""

    pursuer: str
    pursuer_pose: Pose
    intruder_pose: Pose


@dataclass(frozen=True)
class Ends:
    """What happened to an intruder between two instants.

    Args:
        inside: it was inside the area. captured: its capture, or None. left: its pose where it left the area, or None.
    """

    inside: bool = False
    captured: Capture | None = None
    left: Pose | None = None


def ends_of(
    name: str, pursuers: Sequence[str], before: Field, now: Field, area: Region, reach: float, *, entered: bool
) -> Ends:
    """Judge the way of an intruder between two instants. All are taken to move straight and evenly.

    Args:
        pursuers: the pursuers that may capture it, in the order in which they win ties.
        reach: the distance of two centres in m below which the intruder is captured.
        entered: it has been inside the area before.
    """
    if name not in now.poses:
        return Ends()
    b = now.poses[name]
    a = before.poses.get(name, b)
    start, end = (a.x, a.y), (b.x, b.y)
    stretch = area.inside(start, end)
    inside = stretch is not None
    leaves = None
    if (entered or inside) and not area.contains(*end):
        leaves = 0.0 if stretch is None else stretch[1]
    captures = {p: at for p in pursuers if (at := _capture(p, a, b, before, now, reach)) is not None}
    first = min(captures, key=lambda p: captures[p], default=None)
    if first is not None and (leaves is None or captures[first] <= leaves):
        at = captures[first]
        pose = now.poses[first]
        there = interpolate(before.poses.get(first, pose), pose, at)
        return Ends(inside, Capture(first, there, interpolate(a, b, at)))
    return Ends(inside, left=None if leaves is None else interpolate(a, b, leaves))


def _capture(pursuer: str, a: Pose, b: Pose, before: Field, now: Field, reach: float) -> float | None:
    """The fraction of the way at which the centres of the two first come closer than `reach`, or None."""
    if pursuer not in now.poses:
        return None
    q = now.poses[pursuer]
    p = before.poses.get(pursuer, q)
    start, end = (a.x - p.x, a.y - p.y), (b.x - q.x, b.y - q.y)
    stretch = in_disc(start, end, (0.0, 0.0), reach)
    if stretch is None:
        return None
    # A way that only touches the circle comes as near as `reach`, but not closer.
    middle = (stretch[0] + stretch[1]) / 2
    x, y = start[0] + (end[0] - start[0]) * middle, start[1] + (end[1] - start[1]) * middle
    return stretch[0] if math.hypot(x, y) < reach * (1.0 - 1e-12) else None
