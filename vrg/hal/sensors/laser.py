"""Planar laser range finders."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.depiction import Rays
from vrg.hal.sensors.spec import SensorSpec, Sweep
from vrg.types import Deviation, Length, Metres, Pose, Radians

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

RANGES_LIMIT = 10_000
"""The largest number of ranges in a scan."""


class Laser(SensorMessage, frozen=True, kw_only=True):
    """One scan of a laser range finder.

    Args:
        angle_min: the angle of the first beam in the robot's frame, rad. angle_step: the angle between beams, rad.
        range_max: the longest range, m. A beam that met nothing reads range_max, and one that has measured nothing 0.
        data: the ranges in m, as little-endian float32.
    """

    kind = "laser"

    angle_min: Radians
    angle_step: Radians
    range_max: Metres
    data: Annotated[bytes, Meta(max_length=4 * RANGES_LIMIT)]

    def __post_init__(self) -> None:
        if len(self.data) % 4:
            raise ValueError(f"data: expected whole float32 values, got {len(self.data)} bytes")
        # A sum of float32 cannot overflow a Python float, so it is finite exactly where every range is; numpy would
        # take five times as long for a scan.
        if not math.isfinite(sum(memoryview(self.data).cast("f"))):
            raise ValueError("data: expected finite ranges")

    @property
    def ranges(self) -> "npt.NDArray[np.float32]":
        """The range of each beam: shape (beams,), m."""
        import numpy as np  # noqa: PLC0415 - who looks at no scan needs no numpy

        return np.frombuffer(self.data, dtype="<f4")

    @property
    def angles(self) -> "npt.NDArray[np.float64]":
        """The angle of each beam in the robot's frame: shape (beams,), rad."""
        import numpy as np  # noqa: PLC0415 - as above

        return self.angle_min + self.angle_step * np.arange(len(self.data) // 4, dtype=np.float64)

    @property
    def words(self) -> str:
        """The number of beams that met something, and the nearest distance, in words."""
        ranges = memoryview(self.data).cast("f")
        met = [index for index, r in enumerate(ranges) if 0.0 < r < self.range_max]
        if not met:
            return f"{len(ranges)} beams, nothing within {self.range_max:g} m"
        nearest = min(met, key=lambda index: ranges[index])
        bearing = math.degrees(self.angle_min + nearest * self.angle_step)
        return f"{len(ranges)} beams, {len(met)} met something; nearest {ranges[nearest]:.2f} m at {bearing:+.0f}°"


@dataclass(frozen=True, kw_only=True)
class LaserSpec(SensorSpec):
    """A planar laser range finder on a robot.

    Args:
        x: the distance ahead of the body's centre, m. height: the height above ground, m.
        beams: the number of beams. fov: the angle that they cover, symmetric about straight ahead, rad.
        range_max: the longest range, m. noise: standard deviation of a range, m. resolution: the step of a range, m.
    """

    message = Laser
    simulation = "vrg.hal.sim.sensors.laser:LaserSimulation"
    synthesised = True
    depiction = Rays
    range_finder = True

    x: Metres
    height: Metres
    beams: Annotated[int, Meta(ge=1, le=RANGES_LIMIT)]
    fov: Annotated[float, Meta(gt=0.0, le=math.tau)]
    range_max: Length
    noise: Deviation
    resolution: Length

    @property
    def sweep(self) -> Sweep:
        """The sector of its beams."""
        return Sweep(Pose(self.x, 0.0, 0.0), self.fov, self.range_max)

    def depict(self, reading: Laser) -> Rays:
        """The beams of a scan."""
        ranges = memoryview(reading.data).cast("f")
        return Rays(Pose(self.x, 0.0, 0.0), reading.angle_min, reading.angle_step, ranges, reading.range_max)
