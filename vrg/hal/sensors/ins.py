"""The inertial navigation system."""

from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import SensorSpec
from vrg.types import Pose


class Ins(SensorMessage, frozen=True, kw_only=True):
    """Where the robot is on the map.

    Args:
        pose: in the map's frame.
    """

    kind = "ins"

    pose: Pose


@dataclass(frozen=True, kw_only=True)
class InsSpec(SensorSpec):
    """An inertial navigation system. The defaults are estimates for one outdoors that is aided by differential GPS.

    Args:
        position_noise: standard deviation of x and of y, m. heading_noise: rad.
    """

    message = Ins
    simulation = "vrg.hal.sim.sensors.ins:InsSimulation"

    position_noise: float = 0.02
    heading_noise: float = 0.005
