"""The robot model of a mouse."""

import math
from dataclasses import replace

from vrg.hal.models.drivetrain import Drivetrain, Wheel
from vrg.hal.models.turtlebot import TURTLEBOT3
from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sensors.odometry import OdometrySpec

# Five thin beams for the infrared sensors of a mouse: to the right, at 45 degrees, ahead, at 45 degrees, to the left.
INFRARED = LaserSpec(
    name="infrared", x=0.03, height=0.02, beams=5, fov=math.pi, range_max=0.25, noise=0.003, resolution=0.001, rate=50.0
)
# Its builder has calibrated the wheels.
ODOMETRY = OdometrySpec(rate=50.0, scale_noise=0.003, slip_noise=0.02)
WHEELS = ((0.0, 0.035, 0), (0.0, -0.035, 1), (0.04, 0.0, None), (-0.04, 0.0, None))
"""x and y in m and the axis of each wheel; skids at the front and the rear have none."""

MICROMOUSE = replace(
    TURTLEBOT3, name="Micromouse", length=0.10, width=0.08, height=0.04, mass=0.1, v_max=1.0, w_max=12.0, a_max=3.0,
    battery_wh=0.9, idle_w=0.5, colour=(230, 159, 0),
    drivetrain=Drivetrain(
        axes=("left", "right"), wheels=tuple(Wheel(x=x, y=y, axis=axis) for x, y, axis in WHEELS), wheel_radius=0.012,
        wheel_width=0.008,
    ),
    sensors=(INFRARED, ODOMETRY, EncodersSpec(ticks=2048), InsSpec()),
    source="Estimated: as large as common mice, and slower than good ones. A mouse has no INS, but VRG asks for one.",
)  # fmt: skip
