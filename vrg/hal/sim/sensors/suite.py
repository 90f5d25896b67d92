"""All sensors of a world: each kind's simulation, found by the specs of the robots' models."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from vrg.bus.messages import SensorMessage
from vrg.errors import ConfigError
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.sensors.base import Instant, Measured, Mounted, SensorSimulation, Surroundings
from vrg.registry import load_object


class Frame(NamedTuple):
    """The readings of one kind of sensor at one instant, which can be made now or later.

    Args:
        sensors: the robot, the name and the class of the message of each. make: returns them, in any order.
    """

    sensors: list[tuple[str, str, type[SensorMessage]]]
    make: Callable[[], list[Measured]]


class SensorSuite:
    """All sensors of a world.

    Args:
        surroundings: the map, the seed and whether there is noise.
        names: the names of the robots.
        ghosts: for each, whether it is a physical robot. Only those of its sensors that are synthesised are simulated.
        now: the state of the robots before the first tick.

    Raises:
        ConfigError: the simulation of a sensor cannot be imported.
    """

    def __init__(self, surroundings: Surroundings, names: Sequence[str], ghosts: Sequence[bool], now: Instant) -> None:
        self._surroundings = surroundings
        mounted: dict[str, list[Mounted[Any]]] = {}
        for row, (name, model, ghost) in enumerate(zip(names, now.models, ghosts, strict=True)):
            for spec in model.sensors:
                if spec.simulation and (spec.synthesised or not ghost):
                    mounted.setdefault(spec.simulation, []).append(Mounted(row, name, model, spec))
        self._simulations: dict[str, SensorSimulation[Any]] = {
            target: _load(target)(surroundings, sensors, now) for target, sensors in mounted.items()
        }

    @property
    def mounted(self) -> list[tuple[str, SensorSpec]]:
        """The sensors that are simulated: the name of the robot, and the spec of each."""
        return [(m.robot, m.spec) for simulation in self._simulations.values() for m in simulation.mounted]

    def reseed(self, seed: int) -> None:
        """Let the noise depend on another seed from now on."""
        self._surroundings.seed = seed

    def sense(self, now: Instant, *, range_finders: bool = True) -> list[Measured]:
        """The readings of all sensors that are due at this tick. It must be called once per tick.

        Args:
            range_finders: False leaves the range finders out.
        """
        return [reading for frame in self.frames(now, range_finders=range_finders) for reading in frame.make()]

    def frames(self, now: Instant, *, range_finders: bool = True) -> list[Frame]:
        """The readings of all sensors that are due at this tick, by kind; as `sense`, in place of which it is called.

        Readings that can be made later are not yet made.
        """
        frames: list[Frame] = []
        kept: Instant | None = None
        for simulation in self._simulations.values():
            if not range_finders and simulation.mounted[0].spec.range_finder:
                continue
            if not simulation.deferrable:
                if readings := simulation.sense(now):
                    sensors = [(robot, name, type(reading)) for robot, name, reading in readings]
                    frames.append(Frame(sensors, lambda readings=readings: readings))  # type: ignore[misc]
            elif due := simulation.due(now):
                kept = kept or now.kept()
                make = partial(_made, simulation, kept, self._surroundings, self._surroundings.seed)
                frames.append(Frame([(m.robot, m.spec.name, m.spec.message) for m in due], make))
        return frames

    def placed(self, robot: str) -> None:
        """Tell every simulation that a robot was put somewhere else, at rest."""
        for simulation in self._simulations.values():
            simulation.placed(robot)

    def close(self) -> None:
        """Release what the simulations hold. Idempotent."""
        for simulation in self._simulations.values():
            simulation.close()

    def remember(self, robot: str) -> dict[str, Any]:
        """The state of this robot's sensors that a restarted world needs, as plain data by simulation."""
        remembered = {target: simulation.remember(robot) for target, simulation in self._simulations.items()}
        return {target: data for target, data in remembered.items() if data is not None}

    def recall(self, robot: str, remembered: dict[str, Any]) -> None:
        """Go on from what `remember` returned. Data of a simulation that no longer exists is dropped."""
        for target, data in remembered.items():
            if target in self._simulations:
                self._simulations[target].recall(robot, data)


def _made(simulation: SensorSimulation[Any], then: Instant, surroundings: Surroundings, seed: int) -> list[Measured]:
    """The readings of an instant, by the seed that the noise then depended on."""
    newer, surroundings.seed = surroundings.seed, seed
    try:
        return simulation.sense(then)
    finally:
        surroundings.seed = newer


def _load(target: str) -> type[SensorSimulation[Any]]:
    try:
        kind: type[SensorSimulation[Any]] = load_object(target)
    except Exception as error:
        # A sensor of another package may raise anything while it is imported.
        raise ConfigError(f"sensor: cannot import its simulation {target}: {error!r}") from error
    return kind
