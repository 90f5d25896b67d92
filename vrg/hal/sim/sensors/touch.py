"""The simulation of bumpers. The physics engine knows which of them are in contact."""

from vrg.hal.sensors.touch import Touch, TouchSpec
from vrg.hal.sim.sensors.base import Instant, Said, SensorSimulation


class TouchSimulation(SensorSimulation[TouchSpec]):
    """Simulates bumpers: they tell which of them are pressed."""

    def sense(self, now: Instant) -> list[Said]:
        """The bumpers of the robots whose reading is due."""
        return [(m.robot, m.spec.name, Touch(pressed=_bits(now.touch[m.row], m.spec.count))) for m in self.due(now)]


def _bits(number: int, count: int) -> tuple[bool, ...]:
    return tuple(bool(number >> n & 1) for n in range(count)) if number else (False,) * count
