"""The simulation of wheel encoders. They have no noise; only their resolution is finite."""

import math

from vrg.hal.sensors.encoders import Encoders, EncodersSpec
from vrg.hal.sim.sensors.base import Instant, Mounted, SensorSimulation


class EncodersSimulation(SensorSimulation[EncodersSpec]):
    """Simulates encoders: they count the turns of the wheels."""

    def measure(self, mounted: Mounted[EncodersSpec], now: Instant) -> Encoders:
        """The counts of a robot's encoders."""
        per_rad = mounted.spec.ticks / math.tau
        angles = now.angles[mounted.row, : len(mounted.model.drivetrain.axes)].tolist()
        return Encoders(counts=tuple(math.floor(angle * per_rad) for angle in angles))
