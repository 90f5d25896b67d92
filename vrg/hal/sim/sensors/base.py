"""What the simulation of a kind of sensor is given and what it gives."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from vrg.bus.messages import SensorMessage
from vrg.hal.models import RobotModel
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.map import Map
from vrg.hal.sim.sensors.noise import Floats, generator

P = TypeVar("P", bound=SensorSpec)

Said = tuple[str, str, SensorMessage]
"""One reading: the robot's name, the sensor's name on it, and what it says."""


@dataclass(frozen=True)
class Surroundings:
    """What stands still while a world lasts.

    Args:
        map_: the walls and obstacles. seed: of all noise. noise: False = perfect sensors.
    """

    map_: Map
    seed: int
    noise: bool


@dataclass(frozen=True)
class Mounted(Generic[P]):
    """One sensor on one robot.

    Args:
        row: of the robot in the arrays of an `Instant`.
    """

    row: int
    robot: str
    model: RobotModel
    spec: P


@dataclass(frozen=True, slots=True)
class Instant:
    """What is true of all robots at one tick, one row a robot.

    Args:
        tick: number of the tick. dt: s between ticks.
        models: of the robots.
        poses: shape (robots, 3): x, y in m, heading in rad.
        velocities: shape (robots, 2): v in m/s, w in rad/s.
        wheels: shape (robots, 2): angles that the left and the right wheels have turned, rad.
        touch: bit n of a robot's number is set where its bumper n is in contact.
        charge: of a robot's battery by its name, 1 full to 0 empty.
    """

    tick: int
    dt: float
    models: Sequence[RobotModel]
    poses: Floats
    velocities: Floats
    wheels: Floats
    touch: Sequence[int]
    charge: Callable[[str], float]


class SensorSimulation(ABC, Generic[P]):
    """All sensors of one kind in a world. A function of its ticks: it has no clock and no random source of its own."""

    def __init__(self, surroundings: Surroundings) -> None:
        self.surroundings = surroundings
        self.mounted: list[Mounted[P]] = []

    def resize(self, mounted: Sequence[Mounted[P]], now: Instant) -> None:
        """The list of robots has changed, or their rows."""
        self.mounted = list(mounted)

    @abstractmethod
    def sense(self, now: Instant) -> list[Said]:
        """What the sensors say at this tick that are due. Called once a tick."""

    def placed(self, robot: str) -> None:  # noqa: B027 - most sensors remember nothing
        """A robot was put somewhere else, at rest."""

    def remember(self, robot: str) -> Any:
        """What a restarted world must know of this robot's sensor, as plain data; None is nothing."""
        return None

    def recall(self, robot: str, remembered: Any) -> None:  # noqa: B027 - most sensors remember nothing
        """Go on from what was remembered."""

    def due(self, now: Instant) -> list[Mounted[P]]:
        """The sensors whose reading is due at this tick and does come."""
        return [m for m in self.mounted if now.tick % m.spec.due_every(now.dt) == 0 and self._comes(m, now)]

    def _comes(self, mounted: Mounted[P], now: Instant) -> bool:
        spec = mounted.spec
        if not spec.drop_out:
            return True
        rng = generator(self.surroundings.seed, mounted.robot, f"drop-out of {spec.kind} {spec.name}", now.tick)
        return float(rng.random()) >= spec.drop_out
