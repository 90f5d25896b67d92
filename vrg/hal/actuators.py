"""What a robot can do besides moving. A model names its actuators, and a strategy uses them by name."""

from typing import Final

from msgspec import Struct

from vrg.types import FrozenDict

UNUSED: Final = FrozenDict[str, float]()
"""What a robot does that uses none."""


class Kicker(Struct, frozen=True, kw_only=True):
    """A plate in front of a robot that kicks a ball away. Its value is the speed of the kick in m/s.

    Args:
        name: its name on the robot. most: the speed with which it can kick, m/s.
        reach: the distance ahead of the body within which a ball must be, m. width: that of the plate, m.
        pause: the time in s until it can kick again.
    """

    name: str = "kicker"
    most: float
    reach: float = 0.02
    width: float
    pause: float = 1.0
