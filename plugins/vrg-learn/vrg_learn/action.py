"""What a program answers with: the motion of a player as a few numbers."""

import math

import numpy as np
import numpy.typing as npt

from vrg.errors import ConfigError
from vrg.hal.models import RobotModel
from vrg.types import Twist


def limits_of(robot: RobotModel) -> tuple[float, ...]:
    """The top speeds of a robot for each number of an action: v, w, and to the left if it can drive sideways."""
    return (robot.v_max, robot.w_max, robot.v_max) if robot.drivetrain.holonomic else (robot.v_max, robot.w_max)


def twist_of(action: npt.ArrayLike, limits: tuple[float, ...], *, raw: bool = False) -> Twist:
    """The motion that an action stands for. What is beyond the bounds is cut off.

    Args:
        action: a number for each of `limits`: fractions of these from -1 to 1.
        limits: as `limits_of` returns them. raw: True takes m/s and rad/s in place of fractions.

    Raises:
        ConfigError: the action has another shape, or numbers that are not finite, or not real.
    """
    count = len(limits)
    if np.iscomplexobj(action):  # whose imaginary part numpy would drop
        raise ConfigError(f"expected {count} real numbers, got {action!r}")
    try:
        given = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"expected {count} numbers, got {action!r}: {error}") from None
    if given.shape != (count,):
        raise ConfigError(f"expected the shape ({count},), got {given.shape}")
    values = given.tolist()
    if not all(map(math.isfinite, values)):
        raise ConfigError(f"expected finite numbers, got {values}")
    if raw:
        return Twist(*(max(-limit, min(limit, value)) for value, limit in zip(values, limits, strict=True)))
    return Twist(*(limit * max(-1.0, min(1.0, value)) for value, limit in zip(values, limits, strict=True)))


def fractions_of(twist: Twist, limits: tuple[float, ...]) -> npt.NDArray[np.float32]:
    """The action that stands for a motion, shape (len(limits),): the inverse of `twist_of`, within -1 to 1.

    Args:
        limits: as `limits_of` returns them.
    """
    parts = (twist.v, twist.w, twist.side)[: len(limits)]
    found = np.array([value / limit for value, limit in zip(parts, limits, strict=True)], dtype=np.float32)
    return np.clip(found, -1.0, 1.0)
