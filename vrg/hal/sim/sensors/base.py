"""The base class of the simulations of sensors, with the data that they are given and that they return, and noise.

Noise is a function of (world seed, robot, sensor, number of the reading) alone. So a restarted world needs no states of
random generators, and no robot's noise depends on which other robots take part.
"""

import math
import zlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
import numpy.typing as npt
from msgspec import Struct, structs

from vrg.bus.messages import SensorMessage
from vrg.hal.models import RobotModel
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.map import Map
from vrg.hal.sim.sensors.rays import Thing
from vrg.portable.arrays import normals

Floats = npt.NDArray[np.float64]

NO_HEIGHTS: Floats = np.zeros(0)
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
            draws = [normals(generator(seed, n, self._sensor, block), shape) for n in self._names]
            self._drawn = np.stack(draws, axis=1)
        drawn: Floats = self._drawn[index]
        return drawn

    def of(self, numbers: Sequence[int]) -> Floats:
        """The numbers for several readings of all robots: shape (readings, robots, columns)."""
        return np.array([self.at(number) for number in numbers])


P = TypeVar("P", bound=SensorSpec)

Measured = tuple[str, str, SensorMessage]
"""One reading: the robot's name, the sensor's name on that robot, and the sensor's message."""


@dataclass
class Surroundings:
    """The data that all sensors of a world share.

    Args:
        map_: the walls and obstacles. seed: the seed of all noise, which may be replaced between two ticks.
        noise: False means perfect sensors, of which no reading drops out.
    """

    map_: Map
    seed: int
    noise: bool


@dataclass(frozen=True)
class Mounted(Generic[P]):
    """One sensor on one robot.

    Args:
        row: the robot's row in the arrays of an `Instant`.
        robot: the robot's name. model: its model. spec: the spec of the sensor.
    """

    row: int
    robot: str
    model: RobotModel
    spec: P


class Instant(Struct, frozen=True, gc=False):
    """The true state of all robots at one tick. Each array has one row per robot.

    Args:
        tick: the number of the tick. dt: the match time between ticks, s.
        models: the models of the robots.
        poses: shape (robots, 3): x, y in m, heading in rad.
        velocities: shape (robots, 3): v in m/s, w in rad/s, and the speed to the left in m/s.
        angles: shape (robots, axes): the angles that the axes of their drivetrains have turned, rad.
        touch: one number per robot; bit n is set if bumper n is in contact.
        charge: the charge of each battery, from 1 (full) to 0 (empty).
        heights: shape (robots,): the height of each above the ground, m; NO_HEIGHTS where none flies.
        cameras: the names of the robots of whose cameras pictures are requested.
        things: the passive bodies.
    """

    tick: int
    dt: float
    models: Sequence[RobotModel]
    poses: Floats
    velocities: Floats
    angles: Floats
    touch: Sequence[int]
    charge: Floats
    heights: Floats = NO_HEIGHTS
    cameras: Collection[str] = ()
    things: Sequence[Thing] = ()

    def kept(self) -> "Instant":
        """The same, in arrays that the engine does not change."""
        poses, velocities, angles = self.poses.copy(), self.velocities.copy(), self.angles.copy()
        heights = self.heights.copy() if len(self.heights) else NO_HEIGHTS
        return structs.replace(
            self, poses=poses, velocities=velocities, angles=angles, touch=tuple(self.touch), heights=heights
        )

    def level(self, row: int, above: float) -> tuple[float, list[int]]:
        """The height above the ground of a sensor that is `above` m on a robot, and the rows of the robots it can see.

        From the ground it sees all that is on the ground, as each is taken to be as high as it. Of what flies it sees,
        and one that flies sees, only what is at its height.
        """
        heights = self.heights.tolist()
        at = heights[row] + above
        seen = [
            n
            for n, (bottom, model) in enumerate(zip(heights, self.models, strict=True))
            if bottom <= at <= bottom + model.height or (heights[row] == bottom == 0.0)
        ]
        return at, seen


class SensorSimulation(Generic[P]):
    """Simulates all sensors of one kind in a world. Its results depend on its ticks and the seed alone.

    Args:
        mounted: all these sensors. now: the state of the robots before the first tick.

    Attributes:
        deferrable: True if what `sense` returns depends on the instant and the seed alone, and has a reading for each
            sensor that is due. It is then called when somebody wants a reading of that instant, if ever. A subclass
            says it again: what it adds may depend on more.
    """

    deferrable: ClassVar[bool] = False

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.deferrable = bool(vars(cls).get("deferrable", False))

    def __init__(self, surroundings: Surroundings, mounted: Sequence[Mounted[P]], now: Instant) -> None:
        self.surroundings = surroundings
        self.mounted = list(mounted)
        self._schedule = [(m.spec.due_every(now.dt), m) for m in mounted]
        self._beat = math.gcd(*(every for every, _ in self._schedule)) or 1
        """Every reading is due at a multiple of this many ticks."""

    def sense(self, now: Instant) -> list[Measured]:
        """The readings of the sensors that are due at this tick, one after the other. It is called once per tick,
        unless it is `deferrable`."""
        return [(m.robot, m.spec.name, self.measure(m, now)) for m in self.due(now)]

    def measure(self, mounted: Mounted[P], now: Instant) -> SensorMessage:
        """Return the measurement of one sensor. A subclass overrides this, or `sense` if it computes all sensors at
        once."""
        raise NotImplementedError

    def close(self) -> None:
        """Release what the simulation holds. Idempotent."""

    def placed(self, robot: str) -> None:
        """Take note that a robot was put somewhere else, at rest."""

    def remember(self, robot: str) -> Any:
        """The state of this robot's sensor that a restarted world needs, as plain data; None if there is none."""
        return None

    def recall(self, robot: str, remembered: Any) -> None:
        """Go on from what `remember` returned."""

    def due(self, now: Instant) -> list[Mounted[P]]:
        """The sensors whose reading is due at this tick and does not drop out."""
        tick = now.tick
        if tick % self._beat:
            return []
        return [m for every, m in self._schedule if tick % every == 0 and self._comes(m, now)]

    def _comes(self, mounted: Mounted[P], now: Instant) -> bool:
        spec = mounted.spec
        if not (spec.drop_out and self.surroundings.noise):
            return True
        rng = generator(self.surroundings.seed, mounted.robot, f"drop-out of {spec.kind} {spec.name}", now.tick)
        return float(rng.random()) >= spec.drop_out
