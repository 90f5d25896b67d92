"""A sensor of somebody else, which is read and shown, and a robot that carries it; no world simulates it."""

import math
from dataclasses import dataclass, replace

from vrg.bus.messages import SensorMessage
from vrg.hal.models.pioneer import P2AT
from vrg.hal.sensors.depiction import Ticks
from vrg.hal.sensors.spec import SensorSpec


class Needle(SensorMessage, frozen=True, kw_only=True):
    kind = "needle"

    heading: float

    @property
    def words(self) -> str:
        return f"{math.degrees(self.heading):.0f}° from east"


@dataclass(frozen=True, kw_only=True)
class NeedleSpec(SensorSpec):
    message = Needle
    simulation = "needle:NeedleSimulation"
    depiction = Ticks

    def depict(self, reading: Needle) -> Ticks:
        """That of the eight marks around the body which is the nearest to north."""
        north = round((math.pi / 2 - reading.heading) / math.tau * 8) % 8
        return Ticks([number == north for number in range(8)])


PATHFINDER = replace(P2AT, name="Pathfinder", sensors=(*P2AT.sensors, NeedleSpec()))
