"""All sensors of a world: each kind's simulation, found by the specs of the robots' models."""

from collections.abc import Sequence
from typing import Any

from vrg.errors import ConfigError
from vrg.hal.models import RobotModel
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.sensors.base import Instant, Measured, Mounted, SensorSimulation, Surroundings
from vrg.registry import load_object


class SensorSuite:
    """All sensors of a world. It makes the simulation of a kind as soon as a robot has a sensor of that kind.

    Args:
        surroundings: the map, the seed and whether there is noise.
    """

    def __init__(self, surroundings: Surroundings) -> None:
        self._surroundings = surroundings
        self._simulations: dict[str, SensorSimulation[Any]] = {}
        self._used: dict[str, SensorSpec] = {}
        """The spec of a sensor of each simulation that has any."""

    def reseed(self, seed: int) -> None:
        """Let the noise depend on another seed from now on."""
        self._surroundings.seed = seed

    def resize(self, names: Sequence[str], models: Sequence[RobotModel], ghosts: Sequence[bool], now: Instant) -> None:
        """Adapt to a change of the list of robots, or of their rows.

        Args:
            ghosts: for each row, whether it is a physical robot. Of its sensors only the synthesised are simulated.
            now: the state of the robots at this tick.

        Raises:
            ConfigError: the simulation of a sensor cannot be imported.
        """
        mounted: dict[str, list[Mounted[Any]]] = {target: [] for target in self._simulations}
        for row, (name, model, ghost) in enumerate(zip(names, models, ghosts, strict=True)):
            for spec in model.sensors:
                if spec.simulation and (spec.synthesised or not ghost):
                    mounted.setdefault(spec.simulation, []).append(Mounted(row, name, model, spec))
        for target, sensors in mounted.items():
            if target not in self._simulations:
                self._simulations[target] = self._load(target)
            self._simulations[target].resize(sensors, now)
        self._used = {target: sensors[0].spec for target, sensors in mounted.items() if sensors}

    def sense(self, now: Instant, *, range_finders: bool = True) -> list[Measured]:
        """The readings of all sensors that are due at this tick. It must be called once per tick.

        Args:
            range_finders: False leaves the range finders out.
        """
        readings: list[Measured] = []
        for target, spec in self._used.items():
            if range_finders or not spec.range_finder:
                readings += self._simulations[target].sense(now)
        return readings

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

    def _load(self, target: str) -> SensorSimulation[Any]:
        try:
            kind: type[SensorSimulation[Any]] = load_object(target)
        except Exception as error:
            # A sensor of another package may raise anything while it is imported.
            raise ConfigError(f"sensor: cannot import its simulation {target}: {error!r}") from error
        return kind(self._surroundings)
