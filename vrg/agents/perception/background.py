"""The empty scene, and what is unusual in it (thesis 4.2.4).

A snapshot holds how far each beam of a standing laser went in the empty scene. All that it has seen through is known to
be free. A return from known free space is unusual: something has come that was not there. Because this is a statement
about places, it holds for scans from other places too, also from a robot that drives, and for snapshots of others.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from vrg.agents.perception.scan import Floats, Mask, Scan
from vrg.types import Vector

MARGIN = 0.3
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
        """Which points, shape (n, 2), m, are known to be free: shape (n,). Points that are not finite are not."""
        if not len(self.free):
            return np.zeros(len(points), dtype=np.bool_)
        with np.errstate(invalid="ignore"):
            dx, dy = points[:, 0] - self.origin[0], points[:, 1] - self.origin[1]
            away = np.hypot(dx, dy)
            first = self.heading + self.angle_min
            # The turn from the first beam, from 0 to 2 pi, so that scans of a full turn work too.
            turn = np.mod(np.arctan2(dy, dx) - first + self.angle_step / 2, 2 * np.pi)
            beam = np.nan_to_num(turn / self.angle_step, nan=-1.0).astype(np.int64)
            known = (beam >= 0) & (beam < len(self.free)) & np.isfinite(away)
            return np.asarray(known & (away < self.free[np.where(known, beam, 0)]))


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
    reach = np.min([np.minimum(scan.ranges, scan.range_max) for scan in scans], axis=0)
    free = np.maximum(_lowest_around(np.asarray(reach)) - MARGIN, 0.0)
    return Snapshot(first.origin, first.heading, first.angle_min, first.angle_step, free)


def unusual(scan: Scan, snapshots: Iterable[Snapshot], known: Iterable[tuple[Vector, float]] = ()) -> Mask:
    """Which returns of a scan come from known free space, and from nobody known: shape (beams,).

    Args:
        snapshots: what is known to be free.
        known: the robots that tell where they are, such as team mates: the place of each, m, and the distance from
            there within which returns are taken for it, m.
    """
    points = scan.points
    strange = np.zeros(len(points), dtype=np.bool_)
    for each in snapshots:
        strange |= each.contains(points)
    strange &= scan.hits
    for (x, y), radius in known:
        with np.errstate(invalid="ignore"):
            strange &= ~(np.hypot(points[:, 0] - x, points[:, 1] - y) < radius)
    return strange


def _lowest_around(ranges: Floats) -> Floats:
    """The lowest of each range and its SPREAD neighbours on both sides."""
    padded = np.pad(ranges, SPREAD, mode="edge") if len(ranges) else ranges
    windows = [padded[i : i + len(ranges)] for i in range(2 * SPREAD + 1)]
    return np.min(windows, axis=0) if len(ranges) else ranges
