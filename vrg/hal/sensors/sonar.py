"""Rings of ultrasonic range finders."""

import math
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.depiction import Cones
from vrg.hal.sensors.spec import SensorSpec
from vrg.types import Deviation, Length, Metres, Pose

COUNT_LIMIT = 256
"""The largest number of transducers in a ring."""


class Sonar(SensorMessage, frozen=True, kw_only=True):
    """The ranges of all transducers of a ring.

    Args:
        range_max: the longest range, m. A transducer that hears no echo reads range_max.
        ranges: the range of each transducer in the order of the spec, m.
    """

    kind = "sonar"

    range_max: Metres
    ranges: Annotated[tuple[Metres, ...], Meta(max_length=COUNT_LIMIT)]

    @property
    def words(self) -> str:
        """The range of each transducer, m; a dash for one that hears no echo."""
        return " ".join("-" if r >= self.range_max else f"{r:.2f}" for r in self.ranges) + " m"


@dataclass(frozen=True, kw_only=True)
class SonarSpec(SensorSpec):
    """A ring of ultrasonic range finders on a robot.

    Each measures the distance to the nearest surface within its cone, wherever in the cone that is.

    Args:
        places: the pose of each transducer in the robot's frame, m and rad.
        cone: the whole angle of the cone, rad, less than pi.
        range_min: the shortest range, m; anything nearer reads it. range_max: the longest range, m.
        noise: standard deviation of a range, as a fraction of it. resolution: the step of a range, m.
    """

    message = Sonar
    simulation = "vrg.hal.sim.sensors.sonar:SonarSimulation"
    synthesised = True
    depiction = Cones
    range_finder = True

    places: tuple[Pose, ...]
    cone: Annotated[float, Meta(gt=0.0, lt=math.pi)]
    range_min: Deviation
    range_max: Length
    noise: Deviation
    resolution: Length

    def __post_init__(self) -> None:
        if self.range_min > self.range_max:
            raise ValueError(f"expected range_min of at most range_max, {self.range_max:g} m, got {self.range_min:g} m")

    def depict(self, reading: Sonar) -> Cones | None:
        """The cones of all transducers; None if the reading has another number of them."""
        if len(reading.ranges) != len(self.places):
            return None
        return Cones(self.places, self.cone, reading.ranges, reading.range_max)
