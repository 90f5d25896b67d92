"""The robot model of the Pioneer 2-AT by MobileRobots (formerly ActivMedia)."""

import math

from vrg.hal.models.description import RobotModel
from vrg.hal.models.drivetrain import skid_steer
from vrg.hal.models.lms200 import LMS200, lms200
from vrg.hal.sensors.battery import BatterySpec
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sensors.encoders import EncodersSpec
from vrg.hal.sensors.gps import GpsSpec
from vrg.hal.sensors.ins import InsSpec
from vrg.hal.sensors.odometry import OdometrySpec
from vrg.hal.sensors.sonar import SonarSpec
from vrg.hal.sensors.touch import TouchSpec
from vrg.types import Pose

P2_SONAR = (
    "Sonar: the places of the 16 transducers as in ARIA's parameter file p2at-sh.p; a cone of 15 degrees and a range "
    "of 5 m as in Stage's pioneer.inc; a shortest range of 0.1 m, and 25 transducers a second in each ring of eight, "
    "as in the Pioneer 2/3 Operations Manual (not checked against the document itself). Noise and resolution are "
    "estimates. "
)

_QUARTER = ((0.147, 0.136, 90), (0.193, 0.119, 50), (0.227, 0.079, 30), (0.245, 0.027, 10))
"""x and y in m and the heading in degrees of the four transducers at the front left, from the side to the middle."""
_REAR_SHIFT = 0.003
"""The distance in m by which the rear ring is nearer to the middle than the front ring, about."""


def p2_sonar() -> SonarSpec:
    """Return the spec of the front and the rear ring: numbers 0 to 7 from front left to front right, 8 to 15 from rear
    right to rear left.
    """
    left = [(x, y, math.radians(h)) for x, y, h in _QUARTER]
    right = [(x, -y, -h) for x, y, h in reversed(left)]
    front = [*left, *right]
    rear = [(_REAR_SHIFT - x, y, math.pi - h if h > 0 else -math.pi - h) for x, y, h in reversed(front)]
    return SonarSpec(
        name="rings",
        places=tuple(Pose(x, y, h) for x, y, h in [*front, *rear]),
        cone=math.radians(15),
        range_min=0.10,
        range_max=5.0,
        noise=0.01,
        resolution=0.01,
        rate=25 / 8,
    )


P2AT = RobotModel(
    name="P2AT",
    length=0.50,
    width=0.49,
    height=0.26,
    mass=20.0,
    drivetrain=skid_steer(wheel_radius=0.11, wheel_width=0.08, wheelbase=0.27, track=0.40, effective_track=0.582),
    v_max=0.7,
    w_max=2.4,
    a_max=1.0,
    brake=9.0,
    battery_wh=252.0,
    idle_w=40.0,
    rolling=0.05,
    drive_efficiency=0.6,
    sensors=(
        lms200(0.15, 0.35),
        TouchSpec(count=8),
        EncodersSpec(ticks=34_000),
        OdometrySpec(),
        InsSpec(),
        GpsSpec(),
        BatterySpec(),
        p2_sonar(),
        CameraSpec(x=0.15, height=0.45),
    ),
    source=(
        "Length, width, height, wheel diameter (0.22 m), top speed (0.7 m/s), turn rate (140 degrees/s) and "
        "battery (3 x 7 Ah x 12 V): Pioneer 2/3 Operations Manual, ActivMedia; not checked "
        "against the document itself. "
        "Estimated: mass (body, batteries, laser), wheelbase, track, acceleration, encoder ticks (a Pioneer "
        "3-AT's), idle power, rolling resistance, efficiency, laser mount, camera. Brake: locked rubber on dry "
        "concrete, friction 0.92. Effective track: measured in the pybullet engine, see vrg.hal.sim.engines.pybullet; "
        "the robot's own parameter file p2at.p as shipped with p2os has 2 / DiffConvFactor = 0.588 m. "
    )
    + P2_SONAR
    + LMS200,
)
