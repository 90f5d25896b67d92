"""What a robot can do besides moving. A model names its actuators, and a strategy uses them by name."""

from typing import Final

from msgspec import Struct

from vrg.types import FrozenDict

UNUSED: Final = FrozenDict[str, float]()
"""What a robot does that uses none."""


class Actuator(Struct, frozen=True, kw_only=True):
    """Something at the front of a robot that acts on a passive body there.

    Args:
        name: its name on the robot. most: the largest value that it can be used with; the smallest is 0.
        reach: the distance ahead of the body within which it acts, m. width: that of the strip in which it acts, m.
    """

    name: str
    most: float
    reach: float = 0.02
    width: float


class Kicker(Actuator, frozen=True, kw_only=True):
    """A plate that kicks balls away. Its value is the speed of the kick in m/s, and holds for one kick.

    Args:
        pause: the time in s until it can kick again.
    """

    name: str = "kicker"
    pause: float = 1.0


class Gripper(Actuator, frozen=True, kw_only=True):
    """Holds one body. A value above 0 takes the nearest, and 0 lets go; in between it keeps what it has.

    Args:
        load: the mass of the heaviest body that it can hold, kg.
    """

    name: str = "gripper"
    most: float = 1.0
    reach: float = 0.05
    load: float = 1.0


class Dribbler(Actuator, frozen=True, kw_only=True):
    """A roller that pulls a ball to the robot. Its value is the share of its pull, and holds until the next command.

    Args:
        pull: the acceleration that it can give a ball, m/s^2. A ball that would need more to stay is lost.
    """

    name: str = "dribbler"
    most: float = 1.0
    pull: float
