"""The simulation of GPS receivers: satellites that walls may hide, and an error that changes slowly."""

import math

import numpy as np

from vrg.hal.sensors.gps import SATELLITES_FOR_A_FIX, Gps, GpsSpec, to_wgs84
from vrg.hal.sim.map import WALL_HEIGHT
from vrg.hal.sim.sensors.base import Instant, Mounted, Said, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.cones import nearest_in_cones
from vrg.hal.sim.sensors.noise import Floats, generator
from vrg.hal.sim.sensors.rays import Edges

SATELLITES = 11
"""The number of satellites above the horizon. They do not move within a match."""
_NARROW = 1e-3
"""The angle of the cone that stands for a line of sight, rad."""
_FAR = 1e3
"""The distance in m beyond which no wall hides a satellite."""


class GpsSimulation(SensorSimulation[GpsSpec]):
    """Simulates all GPS receivers of a world. The satellites are the same for all of them."""

    def __init__(self, surroundings: Surroundings) -> None:
        super().__init__(surroundings)
        rng = generator(surroundings.seed, "sky", "gps")
        self._azimuths = rng.uniform(-math.pi, math.pi, SATELLITES)
        # Uniform on the half sphere.
        self._elevations = np.arcsin(rng.uniform(0.0, 1.0, SATELLITES))
        self._edges = Edges(surroundings.map_.edges)

    def sense(self, now: Instant) -> list[Said]:
        """The positions of the receivers that are due."""
        return [(m.robot, m.spec.name, self._receive(m, now)) for m in self.due(now)]

    def _receive(self, m: Mounted[GpsSpec], now: Instant) -> Gps:
        x, y, _ = now.poses[m.row].tolist()
        satellites = self._received(m.spec, x, y)
        if satellites < SATELLITES_FOR_A_FIX:
            return Gps(latitude=None, longitude=None, satellites=satellites)
        error = self._error(m, now) if self.surroundings.noise else (0.0, 0.0)
        latitude, longitude = to_wgs84((x + error[0], y + error[1]), self.surroundings.map_.origin)
        return Gps(latitude=latitude, longitude=longitude, satellites=satellites)

    def _received(self, spec: GpsSpec, x: float, y: float) -> int:
        """The number of satellites that are neither too low nor behind a wall."""
        high = self._elevations > spec.mask
        azimuths, elevations = self._azimuths[high], self._elevations[high]
        lines = np.column_stack((np.full(len(azimuths), x), np.full(len(azimuths), y), azimuths))
        walls = nearest_in_cones(lines, _NARROW, _FAR, self._edges, self.surroundings.map_.discs)
        hidden = walls * np.tan(elevations) < WALL_HEIGHT - spec.height
        return int(np.count_nonzero(~hidden))

    def _error(self, m: Mounted[GpsSpec], now: Instant) -> tuple[float, float]:
        """The error to the east and to the north, m.

        It is a moving mean of white noise, so that it depends on the seed and the number of the reading alone.
        """
        number = now.tick // m.spec.due_every(now.dt)
        window = max(1, round(m.spec.correlation * m.spec.rate))
        first, last = number - window + 1, number
        blocks = range(first // window, last // window + 1)
        drawn = np.concatenate([self._white(m, block, window) for block in blocks])
        start = first - first // window * window
        east, north = drawn[start : start + window].sum(axis=0) * m.spec.position_noise / math.sqrt(window)
        return float(east), float(north)

    def _white(self, m: Mounted[GpsSpec], block: int, window: int) -> Floats:
        # Readings before the first tick have numbers, too; a seed has no sign.
        rng = generator(self.surroundings.seed, m.robot, f"gps {m.spec.name}", block + 1)
        drawn: Floats = rng.standard_normal((window, 2))
        return drawn
