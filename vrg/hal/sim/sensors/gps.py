"""The simulation of GPS receivers: satellites that walls may hide, and an error that changes slowly."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from vrg.hal.sensors.gps import SATELLITES_FOR_A_FIX, Gps, GpsSpec, to_wgs84
from vrg.hal.sim.map import WALL_HEIGHT
from vrg.hal.sim.sensors.base import Floats, Instant, Measured, Mounted, SensorSimulation, Surroundings, generator
from vrg.hal.sim.sensors.rays import Edges, nearest_in_cones
from vrg.portable.arrays import cos_sin_array, hypot, normals
from vrg.portable.scalars import asin

SATELLITES = 11
"""The number of satellites above the horizon. They do not move within a match."""
_NARROW = 1e-3
"""The angle of the cone that stands for a line of sight, rad."""
_FAR = 1e3
"""The distance in m beyond which no wall hides a satellite."""


class GpsSimulation(SensorSimulation[GpsSpec]):
    """Simulates all GPS receivers of a world. The satellites are the same for all of them."""

    deferrable = True

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[GpsSpec]], now: Instant) -> None:
        super().__init__(surroundings, mounted, now)
        rng = generator(surroundings.seed, "sky", "gps")
        self._azimuths = rng.uniform(-math.pi, math.pi, SATELLITES)
        # Uniform on the half sphere.
        self._elevations = np.array([asin(height) for height in rng.uniform(0.0, 1.0, SATELLITES).tolist()])
        self._edges = Edges(surroundings.map_.edges)

    def sense(self, now: Instant) -> list[Measured]:
        """The positions of the receivers that are due."""
        due = self.due(now)
        readings: list[Measured] = []
        # All receivers of one kind at once: that takes a quarter of the time of one after the other.
        for mask, height in {(m.spec.mask, m.spec.height): None for m in due}:
            alike = [m for m in due if (m.spec.mask, m.spec.height) == (mask, height)]
            places = now.poses[[m.row for m in alike], :2]
            counts = self._received(mask, height, places)
            for m, (x, y), satellites in zip(alike, places.tolist(), counts.tolist(), strict=True):
                readings.append((m.robot, m.spec.name, self._reading(m, x, y, satellites, now)))
        return readings

    def _reading(self, m: Mounted[GpsSpec], x: float, y: float, satellites: int, now: Instant) -> Gps:
        if satellites < SATELLITES_FOR_A_FIX:
            return Gps(latitude=None, longitude=None, satellites=satellites)
        error = self._error(m, now) if self.surroundings.noise else (0.0, 0.0)
        latitude, longitude = to_wgs84((x + error[0], y + error[1]), self.surroundings.map_.origin)
        return Gps(latitude=latitude, longitude=longitude, satellites=satellites)

    def _received(self, mask: float, height: float, places: Floats) -> npt.NDArray[np.intp]:
        """The number of satellites that are neither too low nor behind a wall: shape (receivers,).

        Args:
            mask: the lowest elevation, rad. height: of the receivers above the ground, m.
            places: of the receivers: shape (receivers, 2), m.
        """
        high = self._elevations > mask
        cos, sin = cos_sin_array(self._elevations[high])
        azimuths, slopes = self._azimuths[high], sin / cos
        wall = WALL_HEIGHT - height
        # A wall that is farther away than this hides no satellite, not even the lowest.
        far = min(_FAR, 1.01 * float(np.max(wall / slopes, initial=0.0)))
        counts = np.full(len(places), len(azimuths))
        near = self._near_walls(places, far)
        if not near.any():
            return counts
        lines = np.empty((np.count_nonzero(near), len(azimuths), 3))
        lines[:, :, :2] = places[near, None]
        lines[:, :, 2] = azimuths
        walls = nearest_in_cones(lines.reshape(-1, 3), _NARROW, far, self._edges, self.surroundings.map_.discs)
        counts[near] = np.count_nonzero(walls.reshape(lines.shape[:2]) * slopes >= wall, axis=1)
        return counts

    def _near_walls(self, places: Floats, far: float) -> npt.NDArray[np.bool_]:
        """True where a place may be within `far` m of a wall or an obstacle: shape (places,)."""
        x, y = places[:, :1], places[:, 1:]
        edges, discs = self._edges, self.surroundings.map_.discs
        x0, y0, x1, y1 = edges.ends
        beside = np.abs(x * edges.normals[0] + y * edges.normals[1] - edges.offsets) < far
        reach = hypot(x1 - x0, y1 - y0) / 2 + far
        near = hypot(x - (x0 + x1) / 2, y - (y0 + y1) / 2) < reach
        round_ = hypot(x - discs[:, 0], y - discs[:, 1]) < discs[:, 2] + far
        found: npt.NDArray[np.bool_] = (beside & near).any(axis=1) | round_.any(axis=1)
        return found

    def _error(self, m: Mounted[GpsSpec], now: Instant) -> tuple[float, float]:
        """The error to the east and to the north, m.

        It is a moving mean of white noise, so that it depends on the seed and the number of the reading alone.
        """
        number = now.tick // m.spec.due_every(now.dt)
        window = max(1, round(m.spec.correlation * m.spec.rate))
        first, last = number - window + 1, number
        blocks = range(first // window, last // window + 1)
        drawn = np.concatenate(
            [_white(self.surroundings.seed, m.robot, m.spec.name, block, window) for block in blocks]
        )
        start = first - first // window * window
        east, north = drawn[start : start + window].sum(axis=0) * m.spec.position_noise / math.sqrt(window)
        return float(east), float(north)


@lru_cache(maxsize=1024)
def _white(seed: int, robot: str, name: str, block: int, window: int) -> Floats:
    """The white noise of a block of readings: shape (window, 2). Each block is needed for two windows' readings."""
    # Readings before the first tick have numbers, too; a seed has no sign.
    drawn: Floats = normals(generator(seed, robot, f"gps {name}", block + 1), (window, 2))
    return drawn
