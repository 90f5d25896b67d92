"""The battery's gauge; vrg.hal.sim.battery empties the battery."""

from vrg.hal.sensors.battery import Battery, BatterySpec
from vrg.hal.sim.sensors.base import Instant, Said, SensorSimulation


class BatterySimulation(SensorSimulation[BatterySpec]):
    """Tells the charge as it is."""

    def sense(self, now: Instant) -> list[Said]:
        """The charge of each robot whose gauge is due."""
        return [(m.robot, m.spec.name, Battery(charge=now.charge(m.robot))) for m in self.due(now)]
