"""The simulation of the battery's gauge. The model of the battery itself is vrg.hal.sim.battery."""

from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sim.sensors.base import Instant, Mounted, SensorSimulation


class BatterySimulation(SensorSimulation[BatterySpec]):
    """Simulates gauges without noise: they tell the true charge."""

    def measure(self, mounted: Mounted[BatterySpec], now: Instant) -> Battery:
        """The charge of a robot's battery."""
        return Battery(charge=now.charge(mounted.robot))
