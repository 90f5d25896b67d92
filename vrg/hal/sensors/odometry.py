"""Odometry: the way of a robot as the turns of its wheels tell it."""

from dataclasses import dataclass

from vrg.bus.messages import SensorMessage
from vrg.hal.sensors.spec import Recorded, SensorSpec
from vrg.types import Deviation, Pose, Twist


class Odometry(SensorMessage, frozen=True, kw_only=True):
    """The way of the robot according to its wheels. Its error grows with the way.

    Args:
        pose: the robot's pose relative to where the odometry began: x was straight ahead there. theta grows beyond pi
            if the robot goes on turning.
        twist: the velocity of the body now, in its own frame.
    """

    kind = "odometry"
    version = 2

    pose: Pose
    twist: Twist


@dataclass(frozen=True, kw_only=True)
class OdometrySpec(SensorSpec):
    """Odometry from the encoders of the wheels.

    Args:
        scale_noise: standard deviation of each side's calibration error, as a fraction. The error is fixed for a robot
            and a seed. The default has the order of magnitude that UMBmark finds.
        slip_noise: standard deviation of the error by slip in one tick of the world, as a fraction of the way of that
            tick.
    """

    message = Odometry
    simulation = "vrg.hal.sim.sensors.odometry:OdometrySimulation"
    recorded = Recorded.NONE

    scale_noise: Deviation = 0.01
    slip_noise: Deviation = 0.05
