"""The simulation of rings of ultrasonic range finders: cones, noise and resolution."""

from collections.abc import Sequence

import numpy as np

from vrg.hal.sensors.sonar import Sonar, SonarSpec
from vrg.hal.sim.sensors.base import Floats, Instant, Measured, Mounted, Noise, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.rays import Edges, among_robots, among_things, nearest_in_cones
from vrg.portable.scalars import cos_sin


class SonarSimulation(SensorSimulation[SonarSpec]):
    """Simulates all ultrasonic rings of a world. They hear the map and all robots, physical ones included."""

    deferrable = True

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[SonarSpec]], now: Instant) -> None:
        super().__init__(surroundings, mounted, now)
        self._static = Edges(surroundings.map_.edges)
        self._places = {(m.robot, m.spec.name): np.array([(p.x, p.y, p.theta) for p in m.spec.places]) for m in mounted}
        self._noises = {
            (m.robot, m.spec.name): Noise(
                lambda: surroundings.seed, f"sonar {m.spec.name}", len(m.spec.places), [m.robot]
            )
            for m in mounted
        }

    def sense(self, now: Instant) -> list[Measured]:
        """The ranges of the rings that are due."""
        due = self.due(now)
        if not due:
            return []
        rows = [row for row in range(len(now.models)) if not len(now.heights) or now.heights[row] == 0.0]
        among = among_robots(self._static, [now.models[row] for row in rows], now.poses[rows])
        edges, discs = among_things(among, self.surroundings.map_.discs, now.things, 0.0)  # a cone widens upwards, too
        readings: list[Measured] = []
        # All rings of one kind at once: that takes a quarter of the time of one after the other.
        for cone, range_max in {(m.spec.cone, m.spec.range_max): None for m in due}:
            alike = [m for m in due if (m.spec.cone, m.spec.range_max) == (cone, range_max)]
            poses = np.concatenate([self._poses(m, now) for m in alike])
            ranges = nearest_in_cones(poses, cone, range_max, edges, discs)
            ends = np.cumsum([len(m.spec.places) for m in alike])
            for m, heard in zip(alike, np.split(ranges, ends[:-1]), strict=True):
                measured = tuple(self._measured(m, heard, now.tick // m.spec.due_every(now.dt)).tolist())
                readings.append((m.robot, m.spec.name, Sonar(range_max=range_max, ranges=measured)))
        return readings

    def _poses(self, m: Mounted[SonarSpec], now: Instant) -> Floats:
        """The poses of the transducers of a ring in the map's frame: shape (transducers, 3), m and rad."""
        places = self._places[m.robot, m.spec.name]
        x, y, heading = now.poses[m.row].tolist()
        c, s = cos_sin(heading)
        poses = np.empty_like(places)
        poses[:, 0] = x + c * places[:, 0] - s * places[:, 1]
        poses[:, 1] = y + s * places[:, 0] + c * places[:, 1]
        poses[:, 2] = heading + places[:, 2]
        return poses

    def _measured(self, m: Mounted[SonarSpec], ranges: Floats, number: int) -> Floats:
        """The ranges of a reading with noise, in steps of the resolution and within limits: shape (transducers,), m."""
        spec = m.spec
        nothing = ranges >= spec.range_max - 1e-9
        if self.surroundings.noise:
            ranges = ranges * (1.0 + spec.noise * self._noises[m.robot, spec.name].at(number)[0])
            ranges = np.rint(ranges / spec.resolution) * spec.resolution
        ranges = np.clip(ranges, spec.range_min, spec.range_max)
        ranges[nothing] = spec.range_max
        return ranges
