"""The geometry of a plot around the robot: ahead is up, left is left. Pure functions, drawing apart."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from vrg.hal.sensors.depiction import Cones, Rays
from vrg.types import Vector
from vrg.ui.view import Pixel
from vrg_views.hud import words

REACHES: Final = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0, 100.0)
"""The distances in m that a plot can reach to."""
RINGS: Final = dict(zip(REACHES, (0.25, 0.5, 1.0, 1.0, 2.0, 3.0, 5.0, 10.0, 10.0, 20.0), strict=True))
"""The distance in m between two rings, by how far the plot reaches."""
CALM: Final = 0.8
"""A plot reaches less far only when everything is within this part of that distance, so that it does not flicker."""


@dataclass(frozen=True)
class PolarPlot:
    """A plot in a window.

    Args:
        origin: the pixel of the robot's centre. scale: pixels per m. reach: m.
    """

    origin: Pixel
    scale: float
    reach: float

    def at(self, x: float, y: float) -> Pixel:
        """The pixel of a point in the robot's frame, m."""
        return self.origin[0] - y * self.scale, self.origin[1] - x * self.scale

    def polar(self, distance: float, bearing: float) -> Pixel:
        """The pixel of a point at a distance (m) and a bearing (rad, to the left)."""
        return self.at(distance * math.cos(bearing), distance * math.sin(bearing))


def polar_plot(area: tuple[int, int, int, int], first: float, last: float, reach: float) -> PolarPlot:
    """Place a plot of the bearings from `first` to `last` (rad) in an area (left, top, width, height)."""
    marks = [first, last, *(k * math.pi / 2 for k in range(-4, 5) if first <= k * math.pi / 2 <= last)]
    rights, ups = [0.0, *(-math.sin(b) for b in marks)], [0.0, *(math.cos(b) for b in marks)]
    left, top, width, height = area
    size = min(width / max(0.1, max(rights) - min(rights)), height / max(0.1, max(ups) - min(ups)))
    x = left + width / 2 - size * (max(rights) + min(rights)) / 2
    y = top + height / 2 + size * (max(ups) + min(ups)) / 2
    return PolarPlot((x, y), size / reach, reach)


def reach_for(farthest: float, before: float | None) -> float:
    """Return the radius of a plot of echoes at most `farthest` m away, if it was `before` m so far."""
    wanted = next((reach for reach in REACHES if farthest <= reach), REACHES[-1])
    if before is None or wanted >= before:
        return wanted
    return next((reach for reach in REACHES if farthest <= CALM * reach), REACHES[-1])


def echoes(rays: Rays) -> "tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]":
    """The distances (m) and the bearings (rad) of the beams that met something."""
    ranges = np.array(rays.ranges, dtype=np.float64)
    met = (ranges > 0.0) & (ranges < rays.range_max)
    return ranges[met], rays.bearings[met]


def nearest(found: Rays | Cones) -> Vector | None:
    """The distance (m) and the bearing (rad) of the nearest thing that beams met or cones heard; None without any."""
    if isinstance(found, Rays):
        return min(zip(*(part.tolist() for part in echoes(found)), strict=True), default=None)
    heard = [(r, place.theta) for r, place in zip(found.ranges, found.places, strict=True) if r < found.range_max]
    return min(heard, default=None)


def nearest_words(found: Rays | Cones) -> str:
    """Return the nearest echo, in words."""
    near = nearest(found)
    if near is None:
        return words.NOTHING_NEAR.format(reach=found.range_max)
    return words.NEAREST.format(distance=near[0], bearing=math.degrees(near[1]) + 0.0)
