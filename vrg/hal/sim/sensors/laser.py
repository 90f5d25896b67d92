"""The simulation of planar laser range finders: rays, noise and resolution. It uses no bus and no clock."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel
from vrg.hal.sensors.laser import Laser, LaserSpec
from vrg.hal.sim.sensors.base import Instant, Said, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.noise import Floats, generator
from vrg.hal.sim.sensors.rays import Edges, Fan, among_robots, cast

_BLOCK = 64
"""The number of scans whose noise is drawn at once."""


class LaserSimulation(SensorSimulation[LaserSpec]):
    """Simulates all laser range finders of a world. They see the map and all robots, physical ones included."""

    def __init__(self, surroundings: Surroundings) -> None:
        super().__init__(surroundings)
        self._static = Edges(surroundings.map_.edges)
        self._edges = self._static
        self._discs = surroundings.map_.discs
        self._blocks: dict[tuple[str, str], tuple[int, Floats]] = {}

    def sense(self, now: Instant) -> list[Said]:
        """The scans of the laser range finders that are due."""
        due = self.due(now)
        if due:
            self.look(now.models, now.poses)
        said: list[Said] = []
        for m in due:
            x, y, heading = now.poses[m.row].tolist()
            ranges = self.scan(m.robot, m.spec, (x, y, heading), now.tick // m.spec.due_every(now.dt))
            fan = Fan.of(m.spec.beams, m.spec.fov)
            scan = Laser(angle_min=fan.first, angle_step=fan.step, range_max=m.spec.range_max, data=ranges.tobytes())
            said.append((m.robot, m.spec.name, scan))
        return said

    def look(self, models: Sequence[RobotModel], poses: Floats) -> None:
        """Take in where all robots are, shape (robots, 3), before the scans of a tick."""
        self._edges = among_robots(self._static, models, poses)

    def scan(
        self, robot: str, spec: LaserSpec, pose: tuple[float, float, float], number: int
    ) -> npt.NDArray[np.float32]:
        """Compute one scan, among the robots that `look` was given.

        Args:
            robot: the robot's name, for the noise. pose: the robot's x and y in m and its heading in rad, in the map's
                frame. number: the number of the scan, for the noise.

        Returns:
            shape (beams,), m, in steps of the resolution; `range_max` where a beam met nothing.
        """
        x, y, heading = pose
        at = x + spec.x * math.cos(heading), y + spec.x * math.sin(heading)
        fan = Fan.of(spec.beams, spec.fov)
        ranges = cast(*at, heading, fan, spec.range_max, self._edges, self._discs)
        if self.surroundings.noise:
            nothing = ranges >= spec.range_max - 1e-9
            ranges += self._draw(robot, spec, number)
            ranges /= spec.resolution
            np.rint(ranges, out=ranges)
            ranges *= spec.resolution
            np.maximum(ranges, 0.0, out=ranges)
            ranges[nothing] = spec.range_max
            np.minimum(ranges, spec.range_max, out=ranges)
        return ranges.astype("<f4")

    def _draw(self, robot: str, spec: LaserSpec, number: int) -> Floats:
        block, index = divmod(number, _BLOCK)
        held = self._blocks.get((robot, spec.name))
        if held is None or held[0] != block:
            rng = generator(self.surroundings.seed, robot, f"laser {spec.name}", block)
            held = self._blocks[robot, spec.name] = (block, rng.standard_normal((_BLOCK, spec.beams)) * spec.noise)
        drawn: Floats = held[1][index]
        return drawn
