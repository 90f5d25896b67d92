"""Odometry by the wheels."""

from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import SensorSpec
from vrg.types import Pose, Twist


class Odometry(SensorMessage, frozen=True, kw_only=True):
    """How far the robot has come by its wheels; this drifts.

    Args:
        pose: from where the odometry began, which is (0, 0, 0).
        twist: the body's velocity now.
    """

    kind = "odometry"

    pose: Pose
    twist: Twist


@dataclass(frozen=True, kw_only=True)
class OdometrySpec(SensorSpec):
    """Odometry by the encoders of the wheels.

    Args:
        scale_noise: standard deviation of each side's calibration error, a fraction, fixed for a robot and a seed (the
            order of magnitude of UMBmark).
        slip_noise: standard deviation of the way of one tick of the world by slip, a fraction of that way.
    """

    message = Odometry
    simulation = "vrg.hal.sim.sensors.odometry:OdometrySimulation"

    scale_noise: float = 0.01
    slip_noise: float = 0.05
