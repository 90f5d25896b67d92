"""The simulation of odometry from the encoders, with each side's calibration error and slip.

The way of each tick is integrated, whatever the rate of the readings is. But that is done only when somebody needs the
result, for all ticks since the last time at once, because numpy takes little longer for several ticks than for one.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from vrg.geometry import wrap
from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sim.sensors.base import Instant, Mounted, Said, SensorSimulation, Surroundings
from vrg.hal.sim.sensors.noise import Floats, Noise, generator
from vrg.types import Pose, Twist

_FINE = 1_000_000
"""The encoders' ticks per turn that are assumed for a robot whose model has odometry but no encoders."""

_LONGEST = 50
"""The number of ticks after which the ways are integrated at the latest."""


class OdometrySimulation(SensorSimulation[OdometrySpec]):
    """Simulates odometry: it adds up the ways of the wheels."""

    def __init__(self, surroundings: Surroundings) -> None:
        super().__init__(surroundings)
        self._noise = Noise(surroundings.seed, "odometry", 2)
        self._index: dict[tuple[str, str], int] = {}
        self._rows: list[int] = []
        self.poses: Floats = np.zeros((0, 3))
        """The poses relative to where the odometry began: shape (robots, 3), m and rad, in the order of `mounted`."""
        self._ticks: list[int] = []
        """The ticks whose ways are not integrated yet."""
        self._wheels: list[Floats] = []
        """The angles of the wheels at the tick before them and at each of them."""
        self._per_rad: Floats = np.zeros((0, 1))
        self._way: Floats = np.zeros((0, 2))
        self._track: Floats = np.zeros(0)
        self._slip: Floats = np.zeros((0, 1))

    def resize(self, mounted: Sequence[Mounted[OdometrySpec]], now: Instant) -> None:
        """Adapt to a change of the list of robots, or of their rows. The odometry of robots that stay goes on."""
        self._catch_up()
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
        self._wheels = [now.wheels.copy()]

    def sense(self, now: Instant) -> list[Said]:
        """Take in the way of this tick, and return the odometry of the robots whose reading is due."""
        if not self._rows:
            return []
        self._ticks.append(now.tick)
        self._wheels.append(now.wheels.copy())
        due = self.due(now)
        if not due and len(self._ticks) < _LONGEST:
            return []
        distance, turn = self._integrate()
        poses, v, w = self.poses.tolist(), (distance / now.dt).tolist(), (turn / now.dt).tolist()
        said: list[Said] = []
        for m in due:
            index = self._index[m.robot, m.spec.name]
            x, y, theta = poses[index]
            odometry = Odometry(pose=Pose(x, y, wrap(theta)), twist=Twist(v[index], w[index]))
            said.append((m.robot, m.spec.name, odometry))
        return said

    def _integrate(self) -> tuple[Floats, Floats]:
        """Integrate the ways since the last time.

        Returns:
            the way of the last tick and its turn: shape (robots,), m and rad.
        """
        counts = np.floor(np.array(self._wheels)[:, self._rows] * self._per_rad)
        self._wheels = self._wheels[-1:]
        ways = (counts[1:] - counts[:-1]) * self._way
        if self.surroundings.noise:
            ways *= 1.0 + self._noise.of(self._ticks) * self._slip
        self._ticks = []
        left, right = ways[:, :, 0], ways[:, :, 1]
        distance, turn = (left + right) * 0.5, (right - left) / self._track
        path = np.empty((len(ways) + 1, len(self._rows), 3))
        path[0] = self.poses
        x, y, heading = path[1:, :, 0], path[1:, :, 1], path[1:, :, 2]
        heading[:] = turn
        middle = path[:, :, 2].cumsum(axis=0)[:-1] + turn * 0.5
        np.multiply(distance, np.cos(middle), out=x)
        np.multiply(distance, np.sin(middle), out=y)
        self.poses = path.cumsum(axis=0)[-1]
        return distance[-1], turn[-1]

    def _catch_up(self) -> None:
        if self._ticks:
            self._integrate()

    def placed(self, robot: str) -> None:
        """Begin a robot's odometry anew, because it was put somewhere else."""
        self._catch_up()
        for index in self._of(robot).values():
            self.poses[index] = 0.0

    def remember(self, robot: str) -> Any:
        """The pose of each odometry of a robot by the sensor's name, as a list of x, y and heading."""
        self._catch_up()
        return {name: self.poses[index].tolist() for name, index in self._of(robot).items()} or None

    def recall(self, robot: str, remembered: Any) -> None:
        """Set the poses of a robot's odometry to what `remember` returned."""
        self._catch_up()
        for name, index in self._of(robot).items():
            self.poses[index] = remembered.get(name, 0.0)

    def _of(self, robot: str) -> dict[str, int]:
        """The rows of a robot's odometry by the sensor's name."""
        return {name: index for (owner, name), index in self._index.items() if owner == robot}


def _ticks(mounted: Mounted[OdometrySpec]) -> int:
    encoders = mounted.model.sensor(EncodersSpec)
    return _FINE if encoders is None else encoders.ticks
