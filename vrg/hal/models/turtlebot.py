"""The robot model of the TurtleBot3 Burger by ROBOTIS, which runs ROS 2."""

import math

from vrg.hal.models.description import RobotModel
from vrg.hal.models.drivetrain import Drivetrain, Wheel
from vrg.hal.sensors.battery import BatterySpec
from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sensors.odometry import OdometrySpec

LDS_01 = LaserSpec(
    name="lds",
    x=0.0,
    height=0.18,
    beams=360,
    fov=math.radians(359.0),
    range_max=3.5,
    noise=0.01,
    resolution=0.001,
    rate=5.0,
)

TURTLEBOT3 = RobotModel(
    name="TurtleBot3",
    length=0.138,
    width=0.178,
    height=0.192,
    mass=1.0,
    drivetrain=Drivetrain(
        axes=("left", "right"),
        wheels=(Wheel(x=0.0, y=0.08, axis=0), Wheel(x=0.0, y=-0.08, axis=1), Wheel(x=-0.06, y=0.0)),
        wheel_radius=0.033,
        wheel_width=0.018,
    ),
    v_max=0.22,
    w_max=2.84,
    a_max=1.0,
    brake=7.0,
    battery_wh=19.98,
    idle_w=5.0,
    rolling=0.03,
    drive_efficiency=0.5,
    sensors=(LDS_01, EncodersSpec(ticks=4096), OdometrySpec(), InsSpec(), BatterySpec()),
    colour=(60, 60, 65),
    source=(
        "Size, mass, top speed, turn rate, battery (11.1 V, 1.8 Ah), encoder ticks of its motors (Dynamixel XL430), "
        "wheel radius and track, and its laser LDS-01 (360 beams, 0.12 to 3.5 m, 5 Hz, precision 10 mm): TurtleBot3 "
        "e-Manual (Burger), ROBOTIS; not checked against the document itself. Its wheels are taken to be in the middle "
        "of the body. Estimated: acceleration, brake, castor, wheel width, idle power, rolling resistance, efficiency, "
        "laser mount."
    ),
)
