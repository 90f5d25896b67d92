"""The simulation of the battery's gauge. The model of the battery itself is vrg.hal.sim.battery."""

from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sim.sensors.base import Instant, Said, SensorSimulation


class BatterySimulation(SensorSimulation[BatterySpec]):
    """Simulates gauges without noise: they tell the true charge."""

    def sense(self, now: Instant) -> list[Said]:
        """The charges of the robots whose gauges are due."""
        return [(m.robot, m.spec.name, Battery(charge=now.charge(m.robot))) for m in self.due(now)]
