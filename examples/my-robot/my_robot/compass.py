"""A sensor of one's own: what it is on a robot (spec), what it says (message), and how the world simulates it."""

import math
from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.geometry import wrap
from vrg.hal.sensors.spec import SensorSpec
from vrg.hal.sim.sensors.base import Instant, Mounted, SensorSimulation, generator
from vrg.portable.arrays import normals
from vrg.types import Radians


class Compass(SensorMessage, frozen=True, kw_only=True):
    """One reading. heading: in the map's frame, rad, counter-clockwise from +x."""

    kind = "compass"

    heading: Radians

    @property
    def words(self) -> str:
        """The heading in degrees, for windows."""
        return f"{math.degrees(self.heading):.0f}°"


@dataclass(frozen=True, kw_only=True)
class CompassSpec(SensorSpec):
    """A compass. noise: standard deviation of the heading, rad."""

    message = Compass
    simulation = "my_robot.compass:CompassSimulation"

    noise: float = 0.02


class CompassSimulation(SensorSimulation[CompassSpec]):
    """Adds noise to the true heading, by seed, robot and tick, so that a match can be repeated."""

    deferrable = True  # it depends on the instant alone: a reading that nobody looks at is never made

    def measure(self, mounted: Mounted[CompassSpec], now: Instant) -> Compass:
        """The noisy heading of a robot."""
        heading = float(now.poses[mounted.row, 2])
        if self.surroundings.noise:
            rng = generator(self.surroundings.seed, mounted.robot, "compass", now.tick)
            heading += mounted.spec.noise * float(normals(rng, 1)[0])
        return Compass(heading=wrap(heading))
