"""A robot on three omni wheels, which drives in any direction without turning."""

import math

from vrg.hal.models import RobotModel
from vrg.hal.models.drivetrain import Drivetrain, Wheel
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.odometry import OdometrySpec

REACH = 0.18
"""The distance of each wheel from the middle, m."""

KIWI = RobotModel(
    name="Kiwi",
    length=0.4,
    width=0.4,
    height=0.2,
    mass=8.0,
    drivetrain=Drivetrain(
        axes=("left", "back", "right"),
        wheels=tuple(
            Wheel(x=REACH * math.cos(at), y=REACH * math.sin(at), heading=at + math.pi / 2, axis=n, rollers=True)
            for n, at in enumerate((math.pi / 3, math.pi, -math.pi / 3))
        ),
        wheel_radius=0.05,
        wheel_width=0.03,
    ),
    v_max=0.8,
    w_max=3.0,
    a_max=1.0,
    brake=6.0,
    battery_wh=50.0,
    idle_w=10.0,
    rolling=0.03,
    drive_efficiency=0.6,
    sensors=(OdometrySpec(), InsSpec()),
    source="Invented for this package.",
)
