"""The simulation of planar laser range finders: rays, noise and resolution. It uses no bus and no clock."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sim.sensors.base import Floats, Instant, Measured, Mounted, SensorSimulation, Surroundings, generator
from vrg.hal.sim.sensors.rays import Edges, Fan, among_robots, among_things, cast_all
from vrg.portable.arrays import cos_sin_array, normals

Floats32 = npt.NDArray[np.float32]
_BLOCK = 64
"""The number of scans whose noise is drawn at once."""


class LaserSimulation(SensorSimulation[LaserSpec]):
    """Simulates all laser range finders of a world. They see the map and all robots, physical ones included."""

    deferrable = True

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[LaserSpec]], now: Instant) -> None:
        super().__init__(surroundings, mounted, now)
        self._static = Edges(surroundings.map_.edges)
        self._edges = self._static
        self._discs = surroundings.map_.discs
        self._seen = self._edges, self._discs
        """What the scans meet that are computed now."""
        self._blocks: dict[tuple[str, str], tuple[tuple[int, int], Floats]] = {}

    def sense(self, now: Instant) -> list[Measured]:
        """The scans of the laser range finders that are due."""
        due = self.due(now)
        if not due:
            return []
        low = bool(self.surroundings.map_.low)
        if not (low or len(now.heights)):
            self.look(now.models, now.poses)
        alike: dict[tuple[Any, ...], list[Mounted[LaserSpec]]] = {}
        for m in due:
            height, seen = m.spec.height if now.things or low else 0.0, None
            if len(now.heights):
                height, rows = now.level(m.row, m.spec.height)
                seen = tuple(rows)
            kind = m.spec.beams, m.spec.fov, m.spec.range_max, m.spec.resolution, seen, height
            alike.setdefault(kind, []).append(m)
        scans: dict[tuple[str, str], Floats32] = {}
        # Those with the same beams are computed together, which is faster than one by one.
        for (*_, seen, height), group in alike.items():
            if seen is None and low:
                self.look(now.models, now.poses, height)
            elif seen is not None:
                self.look([now.models[row] for row in seen], now.poses[list(seen)], height)
            self._seen = among_things(self._edges, self._discs, now.things, height)
            numbers = [now.tick // m.spec.due_every(now.dt) for m in group]
            poses = now.poses[[m.row for m in group]]
            ranges = self.scans([m.robot for m in group], [m.spec for m in group], poses, numbers)
            scans |= {(m.robot, m.spec.name): own for m, own in zip(group, ranges, strict=True)}
        readings: list[Measured] = []
        for m in due:
            fan, data = Fan.of(m.spec.beams, m.spec.fov), scans[m.robot, m.spec.name].tobytes()
            scan = Laser(angle_min=fan.first, angle_step=fan.step, range_max=m.spec.range_max, data=data)
            readings.append((m.robot, m.spec.name, scan))
        return readings

    def look(self, models: Sequence[RobotModel], poses: Floats, height: float = 0.0) -> None:
        """Take in where all robots are, shape (robots, 3), before the scans of a tick.

        Args:
            height: that of the laser, m: it looks over what is lower.
        """
        map_ = self.surroundings.map_.at(height)
        static = self._static if map_ is self.surroundings.map_ else Edges(map_.edges)
        self._edges, self._discs = among_robots(static, models, poses), map_.discs
        self._seen = self._edges, self._discs

    def scans(
        self, robots: Sequence[str], specs: Sequence[LaserSpec], poses: Floats, numbers: Sequence[int]
    ) -> Floats32:
        """Compute the scans of several laser range finders, among the robots that `look` was given.

        Args:
            robots: the names of the robots, for the noise. specs: one for each of them; beams, fov, range_max and
                resolution must be the same in all. poses: of the robots in the map's frame: shape (robots, 3), m and
                rad. numbers: of the scans, for the noise.

        Returns:
            shape (robots, beams), m, in steps of the resolution; `range_max` where a beam met nothing.
        """
        spec = specs[0]
        turns = np.array(cos_sin_array(poses[:, 2]))
        places = poses[:, :2] + (turns * [own.x for own in specs]).T
        fan = Fan.of(spec.beams, spec.fov)
        ranges = cast_all(places, turns, fan, spec.range_max, *self._seen)
        if self.surroundings.noise:
            nothing = ranges >= spec.range_max - 1e-9
            ranges += [self._draw(*each) for each in zip(robots, specs, numbers, strict=True)]
            ranges /= spec.resolution
            np.rint(ranges, out=ranges)
            ranges *= spec.resolution
            np.maximum(ranges, 0.0, out=ranges)
            ranges[nothing] = spec.range_max
            np.minimum(ranges, spec.range_max, out=ranges)
        return ranges.astype("<f4")

    def _draw(self, robot: str, spec: LaserSpec, number: int) -> Floats:
        block, index = divmod(number, _BLOCK)
        held, drawn_from = self._blocks.get((robot, spec.name)), (self.surroundings.seed, block)
        if held is None or held[0] != drawn_from:
            rng = generator(self.surroundings.seed, robot, f"laser {spec.name}", block)
            held = self._blocks[robot, spec.name] = (drawn_from, normals(rng, (_BLOCK, spec.beams)) * spec.noise)
        drawn: Floats = held[1][index]
        return drawn
