"""Control laws: functions of numbers in the map's frame, in metres, seconds and radians."""

import math

from vrg.geometry import ahead, wrap
from vrg.portable.scalars import cos_sin
from vrg.types import Pose, Twist, Vector


def offset_point(pose: Pose, d: float) -> Vector:
    """The point at a distance d (m) ahead of the body's centre (thesis, eq. 2.2)."""
    return ahead(pose.x, pose.y, pose.theta, d)


def linearise(u: Vector, theta: float, d: float) -> Twist:
    """The twist that moves the offset point with velocity u (thesis, eq. 2.3 to 2.5, solved for v and w).

    Args:
        u: the velocity of the offset point, m/s.
        theta: the heading of the body, rad.
        d: the distance of the offset point from the body's centre, m, not 0.
    """
    c, s = cos_sin(theta)
    return Twist(u[0] * c + u[1] * s, (u[1] * c - u[0] * s) / d)


def track(goal: Vector, goal_velocity: Vector, pose: Pose, d: float, gain: float) -> Vector:
    """The velocity of the offset point that makes its tracking error decay (thesis, eq. 2.6).

    Args:
        goal: the point to follow, m. goal_velocity: its velocity, m/s.
        gain: the rate of the decay, 1/s, above 0.
    """
    x, y = offset_point(pose, d)
    return goal_velocity[0] + gain * (goal[0] - x), goal_velocity[1] + gain * (goal[1] - y)


def limit(u: Vector, speed: float) -> Vector:
    """The vector u, shortened to length `speed` if it is longer."""
    length = math.hypot(*u)
    if length <= speed:
        return u
    return u[0] * speed / length, u[1] * speed / length


def scaled(u: Vector, speed: float) -> Vector:
    """The vector u, scaled to length `speed`. The zero vector stays zero."""
    length = math.hypot(*u)
    if length < 1e-9:
        return 0.0, 0.0
    return u[0] * speed / length, u[1] * speed / length


def turn(error: float, tolerance: float) -> Twist:
    """The twist that turns a robot on the spot, at 1 rad/s at most; none within the tolerance.

    Args:
        error: what its heading lacks, rad, -pi to pi. tolerance: rad.
    """
    return Twist(0.0, 0.0 if abs(error) < tolerance else max(-1.0, min(1.0, 2.0 * error)))


def go_to(goal: Pose, pose: Pose, *, d: float, speed: float, reach: float) -> Twist:
    """The twist that drives to a place and then turns to its heading, at 1 rad/s at most.

    Args:
        d: the distance of the offset point from the body's centre, m.
        speed: the top speed of the offset point, m/s.
        reach: the distance in m within which the place counts as reached. It must exceed d, because it is the offset
            point that converges on the goal, and it is ahead of the body's centre.
    """
    if math.hypot(goal.x - pose.x, goal.y - pose.y) < reach:
        return turn(wrap(goal.theta - pose.theta), 0.05)
    return linearise(limit(track((goal.x, goal.y), (0.0, 0.0), pose, d, 1.0), speed), pose.theta, d)
