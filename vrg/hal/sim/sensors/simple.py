"""The simulations of the small sensors: the battery's gauge, bumpers, wheel encoders, and inertial navigation."""

import math
from collections.abc import Sequence

import numpy as np

from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sensors.encoders import Encoders, EncodersSpec
from vrg.hal.sensors.ins import Ins, InsSpec
from vrg.hal.sensors.touch import Touch, TouchSpec
from vrg.hal.sim.sensors.base import Instant, Measured, Mounted, Noise, SensorSimulation, Surroundings
from vrg.types import Pose


class BatterySimulation(SensorSimulation[BatterySpec]):
    """Simulates gauges without noise: they tell the true charge."""

    deferrable = True

    def measure(self, mounted: Mounted[BatterySpec], now: Instant) -> Battery:
        """The charge of a robot's battery."""
        return Battery(charge=float(now.charge[mounted.row]))


class TouchSimulation(SensorSimulation[TouchSpec]):
    """Simulates bumpers: they tell which of them are pressed."""

    deferrable = True

    def measure(self, mounted: Mounted[TouchSpec], now: Instant) -> Touch:
        """The bumpers of a robot: bit n of its contacts is bumper n."""
        bits = now.touch[mounted.row]
        return Touch(pressed=tuple(bool(bits >> n & 1) for n in range(mounted.spec.count)))


class EncodersSimulation(SensorSimulation[EncodersSpec]):
    """Simulates encoders: they count the turns of the wheels."""

    deferrable = True

    def measure(self, mounted: Mounted[EncodersSpec], now: Instant) -> Encoders:
        """The counts of a robot's encoders."""
        per_rad = mounted.spec.ticks / math.tau
        angles = now.angles[mounted.row, : len(mounted.model.drivetrain.axes)].tolist()
        return Encoders(counts=tuple(math.floor(angle * per_rad) for angle in angles))


class InsSimulation(SensorSimulation[InsSpec]):
    """Simulates inertial navigation systems: they measure the robots' true poses plus noise."""

    deferrable = True

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[InsSpec]], now: Instant) -> None:
        super().__init__(surroundings, mounted, now)
        self._noise = Noise(lambda: surroundings.seed, "ins", 3, [f"{m.robot} {m.spec.name}" for m in mounted])
        self._index = {(m.robot, m.spec.name): index for index, m in enumerate(mounted)}
        specs = [m.spec for m in mounted]
        self._deviations = np.array([(s.position_noise, s.position_noise, s.heading_noise) for s in specs])
        """The standard deviations of each system: shape (systems, 3), m, m and rad."""

    def sense(self, now: Instant) -> list[Measured]:
        """The noisy poses of the robots whose reading is due."""
        due = self.due(now)
        if not due:
            return []
        rows = [m.row for m in due]
        poses = now.poses[rows]
        if self.surroundings.noise:
            own = [self._index[m.robot, m.spec.name] for m in due]
            poses += self._noise.at(now.tick)[own] * self._deviations[own]
        if len(now.heights):  # a barometer smooths it, so that it has hardly any noise
            poses = np.column_stack((poses, now.heights[rows]))
        return [(m.robot, m.spec.name, Ins(pose=Pose(*pose))) for m, pose in zip(due, poses.tolist(), strict=True)]
