"""Noise that depends on a seed alone.

Noise is a function of (world seed, robot, sensor, number of the reading) alone. So a restarted world needs no states of
random generators, and no robot's noise depends on which other robots take part.
"""

import zlib
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_BLOCK = 256
"""The number of readings whose noise is drawn at once, because drawing at every reading would be slow."""


def generator(seed: int, robot: str, sensor: str, block: int = 0) -> np.random.Generator:
    """The random generator of one robot's sensor for one block of readings."""
    return np.random.default_rng([seed, zlib.crc32(robot.encode()), zlib.crc32(sensor.encode()), block])


class Noise:
    """Standard normal numbers for a sensor that several robots have.

    Args:
        seed: returns the world's seed. sensor: a word for the sensor.
        columns: how many numbers one reading of a robot needs.
        names: what tells the robots apart, one for each.
    """

    def __init__(self, seed: Callable[[], int], sensor: str, columns: int, names: Sequence[str]) -> None:
        self._seed = seed
        self._sensor = sensor
        self._columns = columns
        self._names = names
        self._block: tuple[int, int] | None = None
        self._drawn: Floats = np.zeros((_BLOCK, 0, columns))

    def at(self, number: int) -> Floats:
        """The numbers for reading `number` of all robots: shape (robots, columns)."""
        block, index = divmod(number, _BLOCK)
        seed = self._seed()
        if (seed, block) != self._block:
            self._block = seed, block
            shape = (_BLOCK, self._columns)
            draws = [generator(seed, n, self._sensor, block).standard_normal(shape) for n in self._names]
            self._drawn = np.stack(draws, axis=1)
        drawn: Floats = self._drawn[index]
        return drawn

    def of(self, numbers: Sequence[int]) -> Floats:
        """The numbers for several readings of all robots: shape (readings, robots, columns)."""
        return np.array([self.at(number) for number in numbers])
