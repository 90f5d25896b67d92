"""The simulation of odometry from the encoders, with each side's calibration error and slip.

The way of each tick is integrated, whatever the rate of the readings is.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sim.sensors.base import Instant, Mounted, Said, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.noise import Floats, Noise, generator
from vrg.types import Pose, Twist

_FINE = 1_000_000
"""The encoders' ticks per turn that are assumed for a robot whose model has odometry but no encoders."""


class OdometrySimulation(SensorSimulation[OdometrySpec]):
    """Simulates odometry: it adds up the ways of the wheels."""

    def __init__(self, surroundings: Surroundings) -> None:
        super().__init__(surroundings)
        self._noise = Noise(surroundings.seed, "odometry", 2)
        self._index: dict[tuple[str, str], int] = {}
        self._rows: list[int] = []
        self.poses: Floats = np.zeros((0, 3))
        """The poses relative to where the odometry began: shape (robots, 3), m and rad, in the order of `mounted`."""
        self._counts: Floats = np.zeros((0, 2))
        self._per_rad: Floats = np.zeros((0, 1))
        self._way: Floats = np.zeros((0, 2))
        self._track: Floats = np.zeros(0)
        self._slip: Floats = np.zeros((0, 1))

    def resize(self, mounted: Sequence[Mounted[OdometrySpec]], now: Instant) -> None:
        """Adapt to a change of the list of robots, or of their rows. The odometry of robots that stay goes on."""
        before = {sensor: self.poses[index] for sensor, index in self._index.items()}
        super().resize(mounted, now)
        names = [(m.robot, m.spec.name) for m in mounted]
        self._index = {name: index for index, name in enumerate(names)}
        self._rows = [m.row for m in mounted]
        self._noise.resize([" ".join(name) for name in names])
        self.poses = np.array([before.get(name, np.zeros(3)) for name in names]).reshape(-1, 3)
        self._per_rad = np.array([_ticks(m) / math.tau for m in mounted]).reshape(-1, 1)
        self._track = np.array([m.model.effective_track for m in mounted])
        self._slip = np.array([m.spec.slip_noise for m in mounted]).reshape(-1, 1)
        scale = np.ones((len(names), 2))
        if self.surroundings.noise:
            for index, m in enumerate(mounted):
                rng = generator(self.surroundings.seed, m.robot, f"scale of odometry {m.spec.name}")
                scale[index] += m.spec.scale_noise * rng.standard_normal(2)
        radius = np.array([m.model.wheel_radius for m in mounted]).reshape(-1, 1)
        self._way = radius / self._per_rad * scale
        self._counts = np.floor(now.wheels[self._rows] * self._per_rad)

    def sense(self, now: Instant) -> list[Said]:
        """Integrate the way of this tick, and return the odometry of the robots whose reading is due."""
        if not self._rows:
            return []
        counts = np.floor(now.wheels[self._rows] * self._per_rad)
        way = (counts - self._counts) * self._way
        self._counts = counts
        if self.surroundings.noise:
            way *= 1.0 + self._noise.at(now.tick) * self._slip
        distance = (way[:, 0] + way[:, 1]) * 0.5
        turn = (way[:, 1] - way[:, 0]) / self._track
        poses = self.poses
        middle = poses[:, 2] + turn * 0.5
        poses[:, 0] += distance * np.cos(middle)
        poses[:, 1] += distance * np.sin(middle)
        poses[:, 2] += turn
        said: list[Said] = []
        for m in self.due(now):
            index = self._index[m.robot, m.spec.name]
            x, y, theta = poses[index].tolist()
            twist = Twist(float(distance[index]) / now.dt, float(turn[index]) / now.dt)
            said.append((m.robot, m.spec.name, Odometry(pose=Pose(x, y, theta), twist=twist)))
        return said

    def placed(self, robot: str) -> None:
        """Begin a robot's odometry anew, because it was put somewhere else."""
        for index in self._of(robot).values():
            self.poses[index] = 0.0

    def remember(self, robot: str) -> Any:
        """The pose of each odometry of a robot by the sensor's name, as a list of x, y and heading."""
        return {name: self.poses[index].tolist() for name, index in self._of(robot).items()} or None

    def recall(self, robot: str, remembered: Any) -> None:
        """Set the poses of a robot's odometry to what `remember` returned."""
        for name, index in self._of(robot).items():
            self.poses[index] = remembered.get(name, 0.0)

    def _of(self, robot: str) -> dict[str, int]:
        """The rows of a robot's odometry by the sensor's name."""
        return {name: index for (owner, name), index in self._index.items() if owner == robot}


def _ticks(mounted: Mounted[OdometrySpec]) -> int:
    encoders = mounted.model.sensor(EncodersSpec)
    return _FINE if encoders is None else encoders.ticks
