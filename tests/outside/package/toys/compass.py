"""A compass: its spec, its message, its simulation, how it is shown, and a robot that carries it."""

import math
from dataclasses import dataclass, replace

from vrg.bus.messages import SensorMessage
from vrg.hal.models.pioneer import P2AT
from vrg.hal.sensors.depiction import Ticks
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.sensors.base import Instant, Mounted, SensorSimulation


class Compass(SensorMessage, frozen=True, kw_only=True):
    kind = "compass"

    heading: float

    @property
    def words(self) -> str:
        return f"{math.degrees(self.heading):.0f}° from east"


@dataclass(frozen=True, kw_only=True)
class CompassSpec(SensorSpec):
    message = Compass
    simulation = "toys.compass:CompassSimulation"
    depiction = Ticks

    def depict(self, reading: Compass) -> Ticks:
        """That of the eight marks around the body which is the nearest to north."""
        north = round((math.pi / 2 - reading.heading) / math.tau * 8) % 8
        return Ticks([number == north for number in range(8)])


class CompassSimulation(SensorSimulation[CompassSpec]):
    def measure(self, mounted: Mounted[CompassSpec], now: Instant) -> Compass:
        return Compass(heading=float(now.poses[mounted.row, 2]))


SCOUT = replace(P2AT, name="Scout", sensors=(*P2AT.sensors, CompassSpec()))
