"""The simulation of the inertial navigation system: the true pose with noise."""

from collections.abc import Sequence

import numpy as np

from vrg.hal.sensors.ins import Ins, InsSpec
from vrg.hal.sim.sensors.base import Instant, Mounted, Said, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.noise import Floats, Noise
from vrg.types import Pose


class InsSimulation(SensorSimulation[InsSpec]):
    """Simulates inertial navigation systems: they tell the robots' true poses plus noise."""

    def __init__(self, surroundings: Surroundings) -> None:
        super().__init__(surroundings)
        self._noise = Noise(surroundings.seed, "ins", 3)
        self._rows: list[int] = []
        self._deviations: Floats = np.zeros((0, 3))
        self._index: dict[tuple[str, str], int] = {}

    def resize(self, mounted: Sequence[Mounted[InsSpec]], now: Instant) -> None:
        """Adapt to a change of the list of robots, or of their rows."""
        super().resize(mounted, now)
        self._noise.resize([f"{m.robot} {m.spec.name}" for m in mounted])
        self._rows = [m.row for m in mounted]
        deviations = [(m.spec.position_noise, m.spec.position_noise, m.spec.heading_noise) for m in mounted]
        self._deviations = np.array(deviations).reshape(-1, 3)
        self._index = {(m.robot, m.spec.name): index for index, m in enumerate(mounted)}

    def sense(self, now: Instant) -> list[Said]:
        """The noisy poses of the robots whose systems are due."""
        due = self.due(now)
        if not due:
            return []
        poses = now.poses[self._rows]
        if self.surroundings.noise:
            poses += self._noise.at(now.tick) * self._deviations
        measured = poses.tolist()
        return [(m.robot, m.spec.name, Ins(pose=Pose(*measured[self._index[m.robot, m.spec.name]]))) for m in due]
