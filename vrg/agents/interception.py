"""The point and the time at which a pursuer can meet a target that keeps its course (thesis, eq. 4.4)."""

import math
from dataclasses import dataclass

from vrg.portable.scalars import square
from vrg.types import Vector


@dataclass(frozen=True, slots=True)
class Interception:
    """A meeting of pursuer and target: after `time` s, with the target at `point` (m)."""

    time: float
    point: Vector


def intercept(
    pursuer: Vector, speed: float, target: Vector, velocity: Vector, *, reach: float = 0.0, k: float = 1.0
) -> Interception | None:
    """The earliest meeting of a pursuer that drives straight at `speed` with a target that keeps its velocity.

    It solves |target + velocity t - pursuer| - reach = k speed t. With reach = 0 this is eq. 4.4: distance_pursuer /
    speed = k distance_target / |velocity|.

    Args:
        pursuer, target: positions, m. speed: m/s. velocity: the target's, m/s.
        reach: the distance in m that counts as met.
        k: 0 < k <= 1; the pursuer needs only the fraction k of the target's time to reach the point.

    Returns:
        the meeting, or None if the target cannot be met.
    """
    dx, dy = target[0] - pursuer[0], target[1] - pursuer[1]
    distance = math.hypot(dx, dy)
    if distance - reach < 1e-9:
        return Interception(0.0, target)
    s = k * speed
    a = square(velocity[0]) + square(velocity[1]) - square(s)
    b = 2 * (dx * velocity[0] + dy * velocity[1] - reach * s)
    c = square(distance) - square(reach)
    time = earliest(a, b, c)
    if time == math.inf:
        return None
    return Interception(time, (target[0] + velocity[0] * time, target[1] + velocity[1] * time))


def earliest(a: float, b: float, c: float) -> float:
    """The smallest positive root of a t^2 + b t + c = 0 with c > 0; infinite if there is none."""
    if abs(a) < 1e-9:
        return -c / b if b < -1e-12 else math.inf
    discriminant = b * b - 4 * a * c
    if discriminant < 0:
        return math.inf
    # This form of the solution does not subtract numbers that are nearly equal.
    q = -(b + math.copysign(math.sqrt(discriminant), b)) / 2
    if q == 0.0:
        return math.inf
    one, other = q / a, c / q
    if one > 0 and other > 0:
        return min(one, other)
    return one if one > 0 else other if other > 0 else math.inf
