"""A robot on three omni wheels."""

import math
from dataclasses import replace

from vrg.hal.models import robot_model
from vrg.hal.models.drivetrain import Drivetrain, Wheel
from vrg.portable.scalars import cos, sin

AXES = ("left", "back", "right")
_P2AT = robot_model("P2AT")
OMNI = replace(
    _P2AT,
    name="Omni",
    drivetrain=Drivetrain(
        axes=AXES,
        wheels=tuple(
            Wheel(x=0.2 * cos(at), y=0.2 * sin(at), heading=at + math.pi / 2, axis=n, rollers=True)
            for n, at in enumerate((math.pi / 3, math.pi, -math.pi / 3))
        ),
        wheel_radius=0.1,
        wheel_width=0.05,
    ),
)
