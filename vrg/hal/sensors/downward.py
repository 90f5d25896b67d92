"""What a robot in the air has below: a range finder that tells its height, and a camera that finds robots."""

import math
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import Rate, Recorded, SensorSpec
from vrg.portable.scalars import cos_sin
from vrg.types import Deviation, Metres, Vector

Range = Annotated[float, Meta(ge=0.0, le=1e3)]


class Altimeter(SensorMessage, frozen=True, kw_only=True):
    """The distance down to the ground, or to what is below.

    Args:
        distance: m; `range_max` of the sensor if nothing is so near.
    """

    kind = "altimeter"

    distance: Range

    @property
    def words(self) -> str:
        """The distance."""
        return f"{self.distance:.2f} m"


@dataclass(frozen=True, kw_only=True)
class AltimeterSpec(SensorSpec):
    """A range finder that looks down. The defaults are estimates for a time-of-flight sensor such as the VL53L1x.

    Args:
        range_max: m. noise: standard deviation of the distance, m.
    """

    message = Altimeter
    simulation = "vrg.hal.sim.sensors.downward:AltimeterSimulation"
    synthesised = True
    recorded = Recorded.NONE

    range_max: Range = 4.0
    noise: Deviation = 0.005


class Overview(SensorMessage, frozen=True, kw_only=True):
    """The robots that a camera which looks down has found, without their names.

    Args:
        places: where each is, in the frame of the robot that looks: m ahead of its centre and to its left.
    """

    kind = "overview"

    places: tuple[tuple[Metres, Metres], ...]

    @property
    def words(self) -> str:
        """How many there are."""
        return f"{len(self.places)} robot{'s' * (len(self.places) != 1)} below"


@dataclass(frozen=True, kw_only=True)
class OverviewSpec(SensorSpec):
    """A camera that looks down, and finds the robots on the ground in its picture. The defaults are estimates.

    Args:
        fov: the angle of the cone in which it sees, rad.
        noise: the standard deviation of a direction, along each axis of the picture, rad.
    """

    message = Overview
    simulation = "vrg.hal.sim.sensors.downward:OverviewSimulation"
    synthesised = True
    recorded = Recorded.NONE

    fov: Annotated[float, Meta(gt=0.0, le=3.0)] = math.radians(120.0)
    noise: Deviation = 0.01
    rate: Rate = 5.0

    def reach(self, height: float) -> float:
        """The radius of the circle on the ground that it sees from a height, m."""
        cos, sin = cos_sin(self.fov / 2)
        return height * sin / cos

    def deviation(self, height: float, place: Vector) -> float:
        """The standard deviation of the place of a robot, along the way to it, m: it grows as the picture is slanted.

        Args:
            height: of the camera, m. place: that of the robot, from the point below the camera, m.
        """
        away = math.hypot(*place)
        return self.noise * (height * height + away * away) / max(height, 1e-3)
