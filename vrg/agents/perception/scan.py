"""A laser scan in the map's frame."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from vrg.geometry import ahead, compose
from vrg.hal.sensors.depiction import Rays
from vrg.portable.arrays import cos_sin_array
from vrg.portable.scalars import cos_sin
from vrg.types import Pose, Vector

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Scan:
    """One scan of a planar laser range finder.

    Args:
        origin: where the laser was, m. heading: its heading, rad. Both in the map's frame.
        angle_min: the angle of the first beam from the heading, rad. angle_step: the angle between beams, rad.
        ranges: shape (beams,), m. It is infinite where a beam met nothing, and NaN where it has measured nothing.
        range_max: the longest range, m.
    """

    origin: Vector
    heading: float
    angle_min: float
    angle_step: float
    ranges: Floats
    range_max: float

    @property
    def full_turn(self) -> bool:
        """True if the last beam and the first one are neighbours."""
        return len(self.ranges) * self.angle_step > 2 * math.pi - self.angle_step / 2

    @cached_property
    def hits(self) -> Mask:
        """The beams that met something: shape (beams,)."""
        return np.isfinite(self.ranges)

    @cached_property
    def bearings(self) -> Floats:
        """The directions of the beams in the map's frame: shape (beams,), rad."""
        steps = np.arange(len(self.ranges), dtype=np.float64)
        return np.asarray(self.heading + self.angle_min + self.angle_step * steps)

    @cached_property
    def points(self) -> Floats:
        """The points at which the beams met something: shape (beams, 2), m; not finite where they met nothing."""
        cos, sin = cos_sin(self.heading)
        along, aside = _directions(self.angle_min, self.angle_step, len(self.ranges))
        points = np.empty((len(self.ranges), 2))
        # An infinite range times the sine or cosine of 0 is no number; both are not finite.
        with np.errstate(invalid="ignore"):
            np.multiply(self.ranges, cos * along - sin * aside, out=points[:, 0])
            np.multiply(self.ranges, sin * along + cos * aside, out=points[:, 1])
        points += self.origin
        return points


@lru_cache(maxsize=64)
def _directions(first: float, step: float, beams: int) -> tuple[Floats, Floats]:
    """The cosines and the sines of the angles of the beams, which are the same in each scan of a range finder."""
    return cos_sin_array(first + step * np.arange(beams, dtype=np.float64))


def make_scan(
    ranges: npt.ArrayLike, pose: Pose, *, mount: float, angle_min: float, angle_step: float, range_max: float
) -> Scan:
    """Put ranges on the map.

    Args:
        ranges: one for each beam, m. One of range_max or more, also an infinite one, met nothing. NaN, and what is not
            above 0, is no measurement.
        pose: the robot's pose at the time of the scan. mount: how far ahead of its centre the laser is, m.

    Raises:
        ValueError: the ranges are not a list of numbers.
    """
    plain = np.array(ranges, dtype=np.float64)
    if plain.ndim != 1:
        raise ValueError(f"expected a list of ranges, got an array of shape {plain.shape}")
    with np.errstate(invalid="ignore"):
        plain[plain >= range_max * (1.0 - 1e-6)] = math.inf
        plain[~(plain > 0.0)] = math.nan
    return Scan(ahead(pose.x, pose.y, pose.theta, mount), pose.theta, angle_min, angle_step, plain, range_max)


def scan_of(rays: Rays, pose: Pose) -> Scan:
    """Put the beams of a range finder on the map; see `make_scan`."""
    eye = compose(pose, Pose(rays.mount.x, rays.mount.y, 0.0))
    return make_scan(
        rays.ranges,
        Pose(eye.x, eye.y, pose.theta + rays.mount.theta),
        mount=0.0,
        angle_min=rays.first,
        angle_step=rays.step,
        range_max=rays.range_max,
    )
