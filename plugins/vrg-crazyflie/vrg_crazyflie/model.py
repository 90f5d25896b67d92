"""The robot model of the Crazyflie 2.1 by Bitcraze, as a robot of the plane that moves in any direction.

Sources: size (92 x 92 x 29 mm, from motor to motor), mass (29 g with the battery; 27 g in other places), battery
(3.7 V, 250 mAh) and time of flight (7 minutes, by which it needs 7.5 W to hover) are of the Crazyflie 2.1 data sheet of
Bitcraze; not checked against the document itself. It accelerates by the tangent of 20 degrees times g, as
PID_VEL_ROLL_MAX limits its tilt (crazyflie-firmware 2026.08, platform_defaults_cf2.h). Its top speed and turn rate are
choices for flying indoors by a Flow deck, far below what it can do. Estimated: wheels, which stand for its rotors,
efficiency, colour.
"""

import math

from vrg.hal.models.description import RobotModel
from vrg.hal.models.drivetrain import Drivetrain, Wheel
from vrg.hal.sensors.battery import BatterySpec
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.odometry import OdometrySpec
from vrg.portable.scalars import cos, sin

ARM = 0.046
"""The distance in m from the middle to a motor: half of the 92 mm between two motors across."""

CRAZYFLIE = RobotModel(
    name="Crazyflie",
    length=0.092,
    width=0.092,
    height=0.029,
    mass=0.029,
    # A drivetrain has wheels: three omni wheels under the arms move the body as freely as four rotors do, and their
    # limit, a hexagon, lies within the circle of all velocities of up to `v_max`.
    drivetrain=Drivetrain(
        axes=("left", "back", "right"),
        wheels=tuple(
            Wheel(x=ARM * cos(at), y=ARM * sin(at), heading=at + math.pi / 2, axis=n, rollers=True)
            for n, at in enumerate((math.pi / 3, math.pi, -math.pi / 3))
        ),
        wheel_radius=0.0225,
        wheel_width=0.005,
    ),
    v_max=0.5,
    w_max=2.0,
    a_max=3.5,
    brake=3.5,
    battery_wh=0.925,
    idle_w=7.5,
    rolling=0.0,
    drive_efficiency=0.5,
    sensors=(OdometrySpec(), InsSpec(), BatterySpec()),
    colour=(30, 30, 30),
    source=(
        "Crazyflie 2.1 data sheet, Bitcraze, not checked against the document itself, and crazyflie-firmware 2026.08. "
        "Top speed and turn rate are choices. Its wheels stand for its rotors; see vrg_crazyflie/model.py."
    ),
)
