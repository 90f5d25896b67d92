"""The inertial navigation system, which measures a robot's pose on the map."""

from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import Recorded, SensorSpec
from vrg.types import Deviation, Pose, Uncertainty


class Ins(SensorMessage, frozen=True, kw_only=True):
    """The pose of the robot on the map.

    Args:
        pose: the robot's pose in the map's frame.
        uncertainty: how well it is known; None if that is not known.
    """

    kind = "ins"
    version = 3

    pose: Pose
    uncertainty: Uncertainty | None = None


@dataclass(frozen=True, kw_only=True)
class InsSpec(SensorSpec):
    """An inertial navigation system. The defaults are estimates for one that is aided by differential GPS outdoors.

    Args:
        position_noise: standard deviation of x and of y, m. heading_noise: standard deviation of the heading, rad.
    """

    message = Ins
    simulation = "vrg.hal.sim.sensors.simple:InsSimulation"
    recorded = Recorded.NONE

    position_noise: Deviation = 0.02
    heading_noise: Deviation = 0.005
