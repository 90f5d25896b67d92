"""Planar laser range finders."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from msgspec import Meta

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import SensorSpec
from vrg.types import Metres, Radians

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

RANGES_LIMIT = 10_000
"""Ranges in the longest scan."""


class Laser(SensorMessage, frozen=True, kw_only=True):
    """One scan.

    Args:
        angle_min, angle_step: of the first beam and between beams, rad in the robot's frame.
        range_max: m; a beam that met nothing reads range_max.
        data: the ranges, little-endian float32, in m.
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
        """Shape (beams,), m."""
        import numpy as np  # noqa: PLC0415 - a player that looks at no scan does without numpy, which takes long to load

        return np.frombuffer(self.data, dtype="<f4")

    @property
    def angles(self) -> "npt.NDArray[np.float64]":
        """Shape (beams,), rad in the robot's frame."""
        import numpy as np  # noqa: PLC0415 - as above

        return self.angle_min + self.angle_step * np.arange(len(self.data) // 4, dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class LaserSpec(SensorSpec):
    """A planar range finder on a robot.

    Args:
        x: m ahead of the body's centre. height: m above ground.
        beams: number of beams. fov: rad covered by them, symmetric about straight ahead.
        range_max: m. noise: standard deviation of a range, m. resolution: step of a range, m.
    """

    message = Laser
    simulation = "vrg.hal.sim.sensors.laser:LaserSimulation"
    synthesised = True

    x: float
    height: float
    beams: int
    fov: float
    range_max: float
    noise: float
    resolution: float
