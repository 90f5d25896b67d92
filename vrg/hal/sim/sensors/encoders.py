"""The simulation of wheel encoders. They have no noise; only their resolution is finite."""

import math

from vrg.hal.sensors.encoders import Encoders, EncodersSpec
from vrg.hal.sim.sensors.base import Instant, Said, SensorSimulation


class EncodersSimulation(SensorSimulation[EncodersSpec]):
    """Simulates encoders: they count the turns of the wheels."""

    def sense(self, now: Instant) -> list[Said]:
        """The counts of the robots whose encoders are due."""
        due = self.due(now)
        if not due:
            return []
        said: list[Said] = []
        angles = now.angles.tolist()
        for m in due:
            left, right = angles[m.row][:2]
            per_rad = m.spec.ticks / math.tau
            counts = Encoders(left=math.floor(left * per_rad), right=math.floor(right * per_rad))
            said.append((m.robot, m.spec.name, counts))
        return said
