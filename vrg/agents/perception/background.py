"""The empty scene, and what is unusual in it (thesis 4.2.4).

A snapshot holds how far each beam of a standing laser went in the empty scene. All that it has seen through is known to
be free. A return from known free space is unusual: something has appeared that was not there. Because this is a
statement about places, it holds for scans from other places too, also from a robot that drives, and for snapshots of
others.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vrg.agents.perception.scan import Floats, Mask, Scan
from vrg.portable.arrays import cos_sin_array, hypot, turn_order
from vrg.portable.scalars import cos_sin
from vrg.types import Vector

OBSTACLE_MARGIN = 0.3
"""The distance in m before a known obstacle in which nothing is unusual: it covers errors of poses and ranges."""
SPREAD = 2
"""The number of beams on both sides of a beam whose obstacles count for it too, because headings are not exact."""


@dataclass(frozen=True)
class Snapshot:
    """The free space around a standing laser.

    Args:
        origin: where the laser was, m. heading: its heading, rad.
        angle_min: the angle of the first beam from the heading, rad. angle_step: the angle between beams, rad.
        free: how far each beam is known to be free, shape (beams,), m; 0 where nothing is known.
    """

    origin: Vector
    heading: float
    angle_min: float
    angle_step: float
    free: Floats

    def contains(self, points: Floats) -> Mask:
        """True for each point, shape (n, 2), m, that is known to be free: shape (n,). Points that are not finite are
        not."""
        known: Mask = np.logical_and.reduce(np.isfinite(points), axis=1)
        if not len(self.free) or not known.any():
            return np.zeros(len(points), dtype=np.bool_)
        dx, dy = (points[known] - self.origin).T
        cos, sin = cos_sin(self.heading + self.angle_min + self.angle_step * (len(self.free) - 1) / 2)
        turn = turn_order(cos * dx + sin * dy, cos * dy - sin * dx)
        beam = self._borders.searchsorted(turn, side="right") - 1
        beyond = (beam < 0) | (beam >= len(self.free))
        beam[beyond] = 0
        known[known] = ~beyond & (hypot(dx, dy) < self.free[beam])
        return known

    @cached_property
    def _borders(self) -> Floats:
        """The turns to the borders of the beams from their middle, as `turn_order` tells them: shape (beams + 1,)."""
        angles = self.angle_step * (np.arange(len(self.free) + 1, dtype=np.float64) - len(self.free) / 2)
        borders = turn_order(*cos_sin_array(angles))
        if angles[-1] > np.pi - 1e-9:  # a full turn, which has neither a beginning nor an end
            borders[0], borders[-1] = -np.inf, np.inf
        return borders

    def coarser(self, beams: int) -> "Snapshot":
        """The same free space with at most so many beams: each is as free as the least free of those it stands for."""
        many = -(-len(self.free) // beams)
        if many <= 1:
            return self
        blocks = np.pad(self.free, (0, -len(self.free) % many)).reshape(-1, many)
        middle = self.angle_min + self.angle_step * (many - 1) / 2
        return Snapshot(self.origin, self.heading, middle, self.angle_step * many, blocks.min(axis=1))


def snapshot(scans: Sequence[Scan]) -> Snapshot:
    """The free space that scans from one place have seen, at most as far as every one of them.

    Raises:
        ValueError: there is no scan, or they are not of the same number of beams.
    """
    if not scans:
        raise ValueError("expected at least one scan, got none")
    lengths = {len(scan.ranges) for scan in scans}
    if len(lengths) > 1:
        raise ValueError(f"expected scans of the same number of beams, got {sorted(lengths)}")
    first = scans[0]
    # The least of each beam, of the scans in which it has measured something.
    reach = np.fmin.reduce([np.minimum(scan.ranges, scan.range_max) for scan in scans])
    lowest = _lowest_around(np.where(np.isnan(reach), 0.0, reach), wrap=first.full_turn)
    free = np.maximum(lowest - OBSTACLE_MARGIN, 0.0)
    return Snapshot(first.origin, first.heading, first.angle_min, first.angle_step, free)


def unusual(scan: Scan, snapshots: Iterable[Snapshot], explained: Mask | None = None) -> Mask:
    """True for each return of a scan that comes from known free space, and from no known robot: shape (beams,).

    Args:
        snapshots: what is known to be free.
        explained: the returns of robots that are known, see `returns_of`.

    Raises:
        ValueError: the mask has not one entry for each beam.
    """
    points = scan.points[scan.hits]
    strange = np.zeros(len(points), dtype=np.bool_)
    for each in snapshots:
        strange |= each.contains(points)
    mask = scan.hits.copy()
    mask[mask] = strange
    if explained is None:
        return mask
    if explained.shape != mask.shape:
        raise ValueError(f"expected a mask of shape {mask.shape}, got {explained.shape}")
    return mask & ~explained


def returns_of(scan: Scan, robots: Iterable[tuple[Vector, float]]) -> Mask:
    """The returns of robots that tell where they are, such as team mates: shape (beams,).

    Args:
        robots: the place of each, m, and the distance from there within which returns are taken for it, m.
    """
    points = scan.points[scan.hits]
    near = np.zeros(len(points), dtype=np.bool_)
    for (x, y), radius in robots:
        near |= hypot(points[:, 0] - x, points[:, 1] - y) < radius
    mask = scan.hits.copy()
    mask[mask] = near
    return mask


def _lowest_around(ranges: Floats, *, wrap: bool) -> Floats:
    """The lowest of each range and its SPREAD neighbours on both sides; with `wrap` the ends are neighbours."""
    if not len(ranges):
        return ranges
    padded = np.pad(ranges, SPREAD, mode="wrap" if wrap else "edge")
    return np.asarray(np.min([padded[i : i + len(ranges)] for i in range(2 * SPREAD + 1)], axis=0))
