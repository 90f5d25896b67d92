"""The simulation of the inertial navigation system: the true pose with noise."""

from collections.abc import Sequence

from vrg.hal.sensors.ins import Ins, InsSpec
from vrg.hal.sim.sensors.base import Instant, Mounted, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.noise import Noise
from vrg.types import Pose


class InsSimulation(SensorSimulation[InsSpec]):
    """Simulates inertial navigation systems: they measure the robots' true poses plus noise."""

    def __init__(self, surroundings: Surroundings) -> None:
        super().__init__(surroundings)
        self._noise = Noise(surroundings.seed, "ins", 3)
        self._index: dict[tuple[str, str], int] = {}

    def resize(self, mounted: Sequence[Mounted[InsSpec]], now: Instant) -> None:
        """Adapt to a change of the list of robots, or of their rows."""
        super().resize(mounted, now)
        self._noise.resize([f"{m.robot} {m.spec.name}" for m in mounted])
        self._index = {(m.robot, m.spec.name): index for index, m in enumerate(mounted)}

    def measure(self, mounted: Mounted[InsSpec], now: Instant) -> Ins:
        """The noisy pose of a robot."""
        pose, spec = now.poses[mounted.row], mounted.spec
        if self.surroundings.noise:
            noise = self._noise.at(now.tick)[self._index[mounted.robot, spec.name]]
            pose = pose + noise * (spec.position_noise, spec.position_noise, spec.heading_noise)
        return Ins(pose=Pose(*pose.tolist()))
