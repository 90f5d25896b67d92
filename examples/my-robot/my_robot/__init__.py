"""A robot of one's own: a smaller and faster Pioneer 2-AT with a compass."""

from dataclasses import replace

from my_robot.compass import CompassSpec
from vrg.hal.models import robot_model

_P2AT = robot_model("P2AT")

SCOUT = replace(
    _P2AT,
    name="Scout",
    length=0.40,
    width=0.38,
    mass=12.0,
    v_max=1.2,
    a_max=2.0,
    sensors=(*_P2AT.sensors, CompassSpec(noise=0.02, rate=20.0)),
    source="an example: no such robot exists",
)
