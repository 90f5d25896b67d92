"""The robot model of the Crazyflie 2.1 by Bitcraze, a quadrotor of the size of a hand."""

from vrg.hal.models.description import RobotModel
from vrg.hal.models.drivetrain import multirotor
from vrg.hal.sensors.battery import BatterySpec
from vrg.hal.sensors.downward import AltimeterSpec, OverviewSpec
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.odometry import OdometrySpec

CRAZYFLIE = RobotModel(
    name="Crazyflie",
    length=0.092,
    width=0.092,
    height=0.029,
    mass=0.027,
    drivetrain=multirotor(
        v_max=1.0, w_max=3.5, climb=0.5, response=0.2, cruise=1.0, ceiling=2.5, hover=7.6, drift=0.01
    ),
    v_max=1.0,
    w_max=3.5,
    a_max=3.5,
    brake=3.5,
    battery_wh=0.925,
    idle_w=0.4,
    rolling=0.0,
    drive_efficiency=1.0,
    sensors=(OdometrySpec(), InsSpec(), BatterySpec(), AltimeterSpec(), OverviewSpec()),
    colour=(30, 30, 30),
    source=(
        "Size, mass and battery (3.7 V, 250 mAh): data sheet of the Crazyflie 2.1, Bitcraze, not checked against the "
        "document itself. It flies for 7 minutes by that, which makes 8 W in all. It accelerates by the tangent of 20 "
        "degrees times gravity, as its firmware limits its tilt (crazyflie-firmware 2026.08, PID_VEL_ROLL_MAX). Top "
        "speeds, cruising height and ceiling are choices. Estimated: response, drift, idle power, a deck with a camera."
    ),
)
