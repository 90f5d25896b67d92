"""The robot model of iRobot's ATRV-Jr."""

from vrg.hal.models.description import RobotModel
from vrg.hal.models.drivetrain import skid_steer
from vrg.hal.models.lms200 import LMS200, lms200
from vrg.hal.sensors.battery import BatterySpec
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.gps import GpsSpec
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.odometry import OdometrySpec
from vrg.hal.sensors.touch import TouchSpec

ATRV_JR = RobotModel(
    name="ATRV-Jr",
    length=0.78,
    width=0.64,
    height=0.55,
    mass=54.0,
    drivetrain=skid_steer(wheel_radius=0.165, wheel_width=0.10, wheelbase=0.42, track=0.53, effective_track=0.863),
    v_max=1.0,
    w_max=2.1,
    a_max=1.0,
    brake=9.0,
    battery_wh=672.0,
    idle_w=80.0,
    rolling=0.05,
    drive_efficiency=0.6,
    sensors=(
        lms200(0.27, 0.62),
        TouchSpec(count=8),
        EncodersSpec(ticks=20_000),
        OdometrySpec(),
        InsSpec(),
        GpsSpec(),
        BatterySpec(),
        CameraSpec(x=0.27, height=0.72),
    ),
    colour=(200, 150, 20),
    source=(
        "Length, width, height, mass (50 kg and the laser), top speed (1 m/s), turn rate (120 degrees/s) and "
        "battery (672 Wh): iRobot ATRV-Jr data sheet; not checked against the "
        "document itself. Estimated: wheel radius, "
        "wheelbase, track, acceleration, encoder ticks, idle power, rolling resistance, efficiency, laser "
        "mount, camera, colour. Brake: as for P2AT. Effective track: measured in the pybullet engine. "
    )
    + LMS200,
)
