"""A small robot with a kicker, about as large and as fast as slow ones of the Small Size League."""

from vrg.hal.actuators import Kicker
from vrg.hal.models.description import RobotModel
from vrg.hal.models.drivetrain import Drivetrain, Wheel
from vrg.hal.sensors.battery import BatterySpec
from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.odometry import OdometrySpec

STRIKER = RobotModel(
    name="Striker",
    length=0.16,
    width=0.17,
    height=0.15,
    mass=2.5,
    drivetrain=Drivetrain(
        axes=("left", "right"),
        wheels=(Wheel(x=0.0, y=0.075, axis=0), Wheel(x=0.0, y=-0.075, axis=1), Wheel(x=-0.06, y=0.0)),
        wheel_radius=0.03,
        wheel_width=0.015,
    ),
    v_max=1.2,
    w_max=8.0,
    a_max=2.5,
    brake=7.0,
    battery_wh=30.0,
    idle_w=8.0,
    rolling=0.03,
    drive_efficiency=0.6,
    sensors=(EncodersSpec(ticks=4096), OdometrySpec(), InsSpec(), BatterySpec()),
    actuators=(Kicker(most=6.0, reach=0.03, width=0.14, pause=1.0),),
    colour=(40, 40, 45),
    source=(
        "The largest body that the Small Size League allows is a cylinder 0.18 m wide and 0.15 m high, and the fastest "
        "kick 6.5 m/s (SSL rules 2.2 and 8.4.1). Its robots have four wheels and drive sideways; this one has two. All "
        "other figures are estimates."
    ),
)
