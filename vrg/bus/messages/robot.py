"""What is said to a robot, and what a robot says of itself besides its sensors' readings."""

from typing import Annotated

from msgspec import Meta

from vrg.bus.messages.base import Message, Text
from vrg.types import AngularSpeed, Name, Pose, Speed, Twist


class Drive(Message, frozen=True, kw_only=True):
    """The motion that a virtual robot is to make until the next command. Not armed means that its motors are off."""

    version = 2

    twist: Twist
    armed: bool = True


class RobotState(Message, frozen=True, kw_only=True):
    """How a virtual robot is.

    Args:
        armed: its motors accept commands.
        estop: the emergency stop is latched.
        fault: what is wrong, in words.
    """

    version = 2

    armed: bool
    estop: bool
    fault: Text | None = None


class MeasuredPose(Message, frozen=True, kw_only=True):
    """Where a physical robot was measured to be, by its own odometry or by a motion-capture system.

    Args:
        v, w: body velocity at that instant, m/s and rad/s.
    """

    pose: Pose
    v: Speed
    w: AngularSpeed


class SpeedLimit(Message, frozen=True, kw_only=True):
    """The top forward speed that the referee allows a robot in this match, m/s."""

    v_max: Annotated[float, Meta(gt=0.0, le=100.0)]


class Recover(Message, frozen=True, kw_only=True):
    """Clear the fault that the robot has latched, if it has one.

    Args:
        by: the official who asks for it.
    """

    by: Name


class Placed(Message, frozen=True, kw_only=True):
    """A person has put the robot at a pose: one that counts its own way goes on counting from there.

    Args:
        by: the official who says so.
    """

    pose: Pose
    by: Name
