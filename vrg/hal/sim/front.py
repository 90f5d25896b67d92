"""What is in front of a robot, and what its kicker, gripper or dribbler does with it."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from vrg.geometry import wrap
from vrg.hal.actuators import Dribbler, Gripper, Kicker
from vrg.hal.models import RobotModel
from vrg.hal.sim.contact import contacts, placed, rectangle
from vrg.hal.sim.rigid import Rigid
from vrg.portable.scalars import cos_sin, hypot
from vrg.types import Pose, Twist, Vector

_EPS = 1e-9


class Grip(NamedTuple):
    """A body that a robot holds.

    Args:
        row: that of the robot in the engine. gripper: the name of its gripper.
        at: the pose of the body in the frame of the robot.
    """

    row: int
    gripper: str
    at: Pose


class Pull(NamedTuple):
    """What a dribbler does in a tick.

    Args:
        row: that of its robot. front: the distance of the robot's front from its middle, m. dribbler: its spec.
        limit: the acceleration that it gives a ball at most, m/s^2.
    """

    row: int
    front: float
    dribbler: Dribbler
    limit: float


def relative(body: Rigid, pose: Pose) -> Vector:
    """The place of a body ahead of a robot and to its left, m."""
    cos, sin = cos_sin(pose.theta)
    dx, dy = body.x - pose.x, body.y - pose.y
    return dx * cos + dy * sin, dy * cos - dx * sin


def kick(bodies: Iterable[Rigid], pose: Pose, twist: Twist, model: RobotModel, kicker: Kicker, speed: float) -> bool:
    """Kick the discs in front of a robot straight ahead, and return whether there was one.

    Args:
        pose, twist: those of the robot. speed: that of the kick relative to the robot, m/s.
    """
    cos, sin = cos_sin(pose.theta)
    kicked = False
    for body in (body for body in bodies if not body.form.corners and body.free):
        radius, (x, aside) = body.form.radius, relative(body, pose)
        ahead = x - model.length / 2 - radius
        v, side = body.vx * cos + body.vy * sin, body.vy * cos - body.vx * sin
        if -radius < ahead <= kicker.reach and abs(aside) <= kicker.width / 2 and v < twist.v + speed:
            v = twist.v + speed
            body.vx, body.vy = v * cos - side * sin, v * sin + side * cos
            kicked = True
    return kicked


def graspable(bodies: Sequence[Rigid], pose: Pose, model: RobotModel, gripper: Gripper) -> int | None:
    """The number of the body that a gripper takes: the nearest to the middle of the robot's front; None if none is."""
    cos, sin = cos_sin(pose.theta)
    front, middle = model.length / 2, (model.length + gripper.reach) / 2
    jaws = placed(rectangle(gripper.reach, gripper.width), pose.x + middle * cos, pose.y + middle * sin, pose.theta)
    x, y = pose.x + front * cos, pose.y + front * sin
    there = [
        (hypot(body.x - x, body.y - y), number)
        for number, body in enumerate(bodies)
        if body.free and body.inverse_mass * gripper.load > 1.0 - _EPS and contacts(body.at, jaws)
    ]
    return min(there)[1] if there else None


def carry(body: Rigid, robot: Rigid, at: Pose) -> None:
    """Move a body rigidly with a robot.

    Args:
        at: its pose in the robot's frame.
    """
    cos, sin = cos_sin(robot.theta)
    dx, dy = at.x * cos - at.y * sin, at.x * sin + at.y * cos
    body.put(robot.x + dx, robot.y + dy, wrap(robot.theta + at.theta))
    body.vx, body.vy, body.w = robot.vx - robot.w * dy, robot.vy + robot.w * dx, robot.w


def dribble(ball: Rigid, pull: Pull, robot: Rigid, before: Pose, after: Pose, dt: float) -> bool:
    """Pull a body, if it is a ball that nothing holds, to the robot's front; return whether it stays with the robot.

    The ball gets the velocity with which it keeps its place at the robot in the next dt seconds, or, if that is more
    than the pull can change, as much of the change as it can. The robot gets the opposite impulse.

    Args:
        before, after: the poses of the robot between which it moves in these dt seconds.
    """
    radius, (x, aside) = ball.form.radius, relative(ball, before)
    gap = x - pull.front - radius
    if (
        ball.form.corners
        or not ball.free
        or not (-radius < gap <= pull.dribbler.reach and abs(aside) <= pull.dribbler.width / 2)
    ):
        return False
    gap = max(0.0, gap)
    # It must not come faster than the pull can stop it again, or it would bounce off.
    ahead = pull.front + radius + gap - min(gap, math.sqrt(2.0 * pull.limit * gap) * dt)
    cos, sin = cos_sin(after.theta)
    dx = (after.x + ahead * cos - aside * sin - ball.x) / dt - ball.vx
    dy = (after.y + ahead * sin + aside * cos - ball.y) / dt - ball.vy
    needed, most = hypot(dx, dy), pull.limit * dt
    if needed > most:
        dx, dy = dx * most / needed, dy * most / needed
    ball.push(dx / ball.inverse_mass, dy / ball.inverse_mass, ball.x, ball.y)
    robot.push(-dx / ball.inverse_mass, -dy / ball.inverse_mass, ball.x, ball.y)
    return needed <= most
