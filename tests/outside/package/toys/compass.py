"""A compass: its spec, its message, its simulation, and a robot that carries it."""

from dataclasses import dataclass, replace

from vrg.bus.messages import SensorMessage
from vrg.hal.models.pioneer import P2AT
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.sensors.base import Instant, Said, SensorSimulation


class Compass(SensorMessage, frozen=True, kw_only=True):
    kind = "compass"

    heading: float


@dataclass(frozen=True, kw_only=True)
class CompassSpec(SensorSpec):
    message = Compass
    simulation = "toys.compass:CompassSimulation"


class CompassSimulation(SensorSimulation[CompassSpec]):
    def sense(self, now: Instant) -> list[Said]:
        return [(m.robot, m.spec.name, Compass(heading=float(now.poses[m.row, 2]))) for m in self.due(now)]


SCOUT = replace(P2AT, name="Scout", sensors=(*P2AT.sensors, CompassSpec()))
