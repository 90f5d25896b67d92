"""INS, encoders and odometry of all robots at once, with noise that a seed fixes. Pure.

Noise is a function of (world seed, robot, kind of sensor, tick) alone: a restarted world needs no generator states,
and no robot's noise depends on which others take part.
"""

import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vrg.hal.models import RobotModel

Floats = npt.NDArray[np.float64]

INS_SIGMA = (0.02, 0.02, 0.005)
"""Standard deviation of the INS: x, y in m, heading in rad. Estimated: an outdoor INS aided by differential GPS."""
SCALE_SIGMA = 0.01
"""Standard deviation of each wheel's calibration error, a fraction; fixed for a robot and seed (UMBmark's order)."""
SLIP_SIGMA = 0.05
"""Standard deviation of a tick's way by slip, a fraction of it."""

_BLOCK = 256
"""Ticks of noise drawn at once; drawing each tick for each robot would cost more than moving it."""


def generator(seed: int, robot: str, kind: str, block: int = 0) -> np.random.Generator:
    """The random generator of one robot's sensor for one block of time."""
    return np.random.default_rng([seed, zlib.crc32(robot.encode()), zlib.crc32(kind.encode()), block])


@dataclass(frozen=True, slots=True)
class Reading:
    """One instant of all robots, one row a robot.

    Args:
        ins, odometry: shape (robots, 3): x, y, heading; m, rad.
        velocity: shape (robots, 2): v in m/s, w in rad/s, by the encoders.
        encoders: shape (robots, 2): ticks, left and right.
    """

    ins: Floats
    odometry: Floats
    velocity: Floats
    encoders: npt.NDArray[np.int64]


class Sensors:
    """The sensors of a fleet.

    Args:
        seed: of the world. noise: False = perfect sensors, but for the encoders' resolution.
    """

    def __init__(self, seed: int, noise: bool) -> None:
        self._seed = seed
        self._noisy = noise
        self._names: list[str] = []
        self._block = -1
        self._noise: Floats = np.zeros((_BLOCK, 0, 5))
        self._counts: Floats = np.zeros((0, 2))
        self.odometry: Floats = np.zeros((0, 3))
        """Shape (robots, 3); may be set when a robot is placed or restored."""
        self._per_rad: Floats = np.zeros((0, 1))
        self._way: Floats = np.zeros((0, 2))
        self._track: Floats = np.zeros(0)

    def resize(self, names: list[str], models: list[RobotModel], wheels: Floats, odometry: Floats) -> None:
        """Take over a new list of robots: their wheel angles (rad) and odometry, one row a robot."""
        self._names = list(names)
        self._per_rad = np.array([m.encoder_ticks / (2 * np.pi) for m in models]).reshape(-1, 1)
        self._track = np.array([m.effective_track for m in models])
        scale = np.ones((len(names), 2))
        if self._noisy:
            for row, name in enumerate(names):
                scale[row] += SCALE_SIGMA * generator(self._seed, name, "scale").standard_normal(2)
        radius = np.array([m.wheel_radius for m in models]).reshape(-1, 1)
        self._way = radius / self._per_rad * scale
        self._counts = np.floor(wheels * self._per_rad)
        self.odometry = odometry
        self._block = -1

    def read(self, tick: int, dt: float, poses: Floats, wheels: Floats) -> Reading:
        """Read all sensors once a tick.

        Args:
            tick: the world's. dt: s since the last reading.
            poses: shape (robots, 3), the truth. wheels: shape (robots, 2), angles turned, rad.
        """
        counts = np.floor(wheels * self._per_rad)
        way = (counts - self._counts) * self._way
        self._counts = counts
        ins = poses
        if self._noisy:
            noise = self._draw(tick)
            ins = poses + noise[:, :3]
            way *= noise[:, 3:]
        distance = (way[:, 0] + way[:, 1]) * 0.5
        turn = (way[:, 1] - way[:, 0]) / self._track
        odometry = self.odometry
        middle = odometry[:, 2] + turn * 0.5
        odometry[:, 0] += distance * np.cos(middle)
        odometry[:, 1] += distance * np.sin(middle)
        odometry[:, 2] += turn
        velocity = np.empty((len(counts), 2))
        velocity[:, 0], velocity[:, 1] = distance, turn
        velocity /= dt
        return Reading(ins, odometry, velocity, counts.astype(np.int64))

    def _draw(self, tick: int) -> Floats:
        """This tick's noise: shape (robots, 5): INS offsets, then factors of the ways of left and right wheels."""
        block, index = divmod(tick, _BLOCK)
        if block != self._block:
            self._block = block
            draws = [generator(self._seed, name, "sensors", block).standard_normal((_BLOCK, 5)) for name in self._names]
            self._noise = np.stack(draws, axis=1) if draws else np.zeros((_BLOCK, 0, 5))
            self._noise *= (*INS_SIGMA, SLIP_SIGMA, SLIP_SIGMA)
            self._noise[:, :, 3:] += 1.0
        drawn: Floats = self._noise[index]
        return drawn
