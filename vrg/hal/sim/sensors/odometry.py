"""The simulation of odometry from the encoders, with each axis' calibration error and slip.

The way of each tick is integrated, whatever the rate of the readings is. But that is done only when a node needs the
result, for all ticks since the last time at once, because numpy takes little longer for several ticks than for one.
"""

import math
from collections.abc import Sequence
from itertools import accumulate, groupby
from typing import Any

import numpy as np

from vrg.geometry import wrap
from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.odometry import Odometry, OdometrySpec
from vrg.hal.sim.compiled import kernel
from vrg.hal.sim.sensors.base import (
    Floats,
    Instant,
    Measured,
    Mounted,
    Noise,
    SensorSimulation,
    Surroundings,
    generator,
)
from vrg.portable.arrays import cos_sin_array, normals
from vrg.types import Pose, Twist

_FINE = 1_000_000
"""The encoders' ticks per turn that are assumed for a robot whose model has odometry but no encoders."""

_LONGEST = 50
"""The number of ticks after which the ways are integrated at the latest."""

_IN_ORDER = 8
"""The number of axes up to which numpy adds their ways one after the other, as the kernel does."""


class OdometrySimulation(SensorSimulation[OdometrySpec]):
    """Simulates odometry: it adds up the ways of the wheels. Its arrays have one column for each axis of each robot."""

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[OdometrySpec]], now: Instant) -> None:
        mounted = sorted(mounted, key=_axes)  # those with as many axes have a source of noise together
        super().__init__(surroundings, mounted, now)
        self._index = {(m.robot, m.spec.name): index for index, m in enumerate(mounted)}
        self.poses: Floats = np.zeros((len(mounted), 3))
        """The poses relative to where the odometry began: shape (robots, 3), m and rad, in the order of `mounted`."""
        self._ticks: list[int] = []
        """The ticks whose ways are not integrated yet."""
        self._angles = [now.angles.copy()]
        """The angles of the axes at the tick before them and at each of them."""
        self._noises = [
            Noise(lambda: surroundings.seed, "odometry", count, [f"{m.robot} {m.spec.name}" for m in group])
            for count, group in groupby(mounted, _axes)
        ]
        counts = [_axes(m) for m in mounted]
        columns = now.angles.shape[1]
        self._axes = np.array([m.row * columns + axis for m in mounted for axis in range(_axes(m))], np.intp)
        """The axis of each column, as the number of its angle among those of all axes of all robots."""
        self._kernel = kernel if max(counts, default=0) <= _IN_ORDER else None
        self._per_rad = np.repeat([_ticks(m) / math.tau for m in mounted], counts)
        self._slip = np.repeat([m.spec.slip_noise for m in mounted], counts)
        scale = np.ones(sum(counts))
        self._motions: Floats = np.zeros((sum(counts), 3))
        """The effect of each column on the way ahead, the turn, and the way to the left of its robot."""
        self._starts = np.array([0, *accumulate(counts)][:-1], np.intp)
        """The first column of each robot."""
        for m, start in zip(mounted, self._starts, strict=True):
            own = slice(start, start + _axes(m))
            if surroundings.noise:
                rng = generator(surroundings.seed, m.robot, f"scale of odometry {m.spec.name}")
                scale[own] += m.spec.scale_noise * normals(rng, _axes(m))
            self._motions[own] = np.transpose(m.model.drivetrain.motions)
        self._turned = scale / self._per_rad
        """The angle of one count, rad, with the calibration error of the axis."""

    def sense(self, now: Instant) -> list[Measured]:
        """Take in the way of this tick, and return the odometry of the robots whose reading is due."""
        self._ticks.append(now.tick)
        self._angles.append(now.angles.copy())
        due = self.due(now)
        if not due and len(self._ticks) < _LONGEST:
            return []
        twists, poses = (self._integrate() / now.dt).tolist(), self.poses.tolist()
        readings: list[Measured] = []
        for m in due:
            index = self._index[m.robot, m.spec.name]
            x, y, theta = poses[index]
            odometry = Odometry(pose=Pose(x, y, wrap(theta)), twist=Twist(*twists[index]))
            readings.append((m.robot, m.spec.name, odometry))
        return readings

    def _integrate(self) -> Floats:
        """Integrate the ways since the last time.

        Returns:
            how each robot has moved in the last tick: shape (robots, 3): its way ahead in m, its turn in rad, and its
            way to the left in m.
        """
        angles = np.array(self._angles).reshape(len(self._angles), -1)
        self._angles = self._angles[-1:]
        factors = np.ones((len(self._ticks), len(self._axes)))
        if self.surroundings.noise:
            drawn = [noise.of(self._ticks).reshape(len(self._ticks), -1) for noise in self._noises]
            factors += (drawn[0] if len(drawn) == 1 else np.concatenate(drawn, axis=1)) * self._slip
        self._ticks = []
        if self._kernel is not None:
            self.poses, moved = self.poses.copy(), np.empty(self.poses.shape)
            self._kernel.integrate(
                angles, self._axes, self._per_rad, self._turned, factors, self._motions, self._starts, self.poses, moved
            )
            return moved
        counts = np.floor(angles[:, self._axes] * self._per_rad)
        ways = (counts[1:] - counts[:-1]) * self._turned * factors
        # Not as a product of matrices, whose last bits depend on the computer and on the other robots.
        moved = np.add.reduceat(ways[:, :, np.newaxis] * self._motions, self._starts, axis=1)
        ahead, turn, aside = moved[:, :, 0], moved[:, :, 1], moved[:, :, 2]
        path = np.empty((len(ways) + 1, len(self.poses), 3))
        path[0] = self.poses
        x, y, heading = path[1:, :, 0], path[1:, :, 1], path[1:, :, 2]
        heading[:] = turn
        middle = path[:, :, 2].cumsum(axis=0)[:-1] + turn * 0.5
        cos, sin = cos_sin_array(middle)
        x[:] = ahead * cos - aside * sin
        y[:] = ahead * sin + aside * cos
        self.poses = path.cumsum(axis=0)[-1]
        last: Floats = moved[-1]
        return last

    def _catch_up(self) -> None:
        if self._ticks:
            self._integrate()

    def placed(self, robot: str) -> None:
        """Begin a robot's odometry again, because it was put somewhere else."""
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


def _axes(mounted: Mounted[OdometrySpec]) -> int:
    return len(mounted.model.drivetrain.axes)


def _ticks(mounted: Mounted[OdometrySpec]) -> int:
    encoders = mounted.model.sensor(EncodersSpec)
    return _FINE if encoders is None else encoders.ticks
