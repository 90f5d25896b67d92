"""The simulation of bumpers. The physics engine knows which of them are in contact."""

from vrg.hal.sensors.touch import Touch, TouchSpec
from vrg.hal.sim.sensors.base import Instant, Mounted, SensorSimulation


class TouchSimulation(SensorSimulation[TouchSpec]):
    """Simulates bumpers: they tell which of them are pressed."""

    def measure(self, mounted: Mounted[TouchSpec], now: Instant) -> Touch:
        """The bumpers of a robot: bit n of its contacts is bumper n."""
        bits = now.touch[mounted.row]
        return Touch(pressed=tuple(bool(bits >> n & 1) for n in range(mounted.spec.count)))
