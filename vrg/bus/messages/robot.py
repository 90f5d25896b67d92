"""The messages to a robot, and those about a robot besides its sensors' readings."""

from typing import Annotated

from msgspec import Meta

from vrg.bus.messages.base import Message, Text
from vrg.types import STILL, Name, Pose, Twist


class Drive(Message, frozen=True, kw_only=True):
    """The motion of a virtual robot until the next command.

    Args:
        twist: the motion.
        armed: False means that its motors must be off.
    """

    version = 3

    twist: Twist
    armed: bool = True


class RobotState(Message, frozen=True, kw_only=True):
    """The state of a virtual robot.

    Args:
        armed: True if its motors accept commands.
        estop: True if the emergency stop is latched in the world.
        fault: what is wrong, in words; None if nothing is.
    """

    version = 2

    armed: bool
    estop: bool
    fault: Text | None = None


class MeasuredPose(Message, frozen=True, kw_only=True):
    """The measured pose of a physical robot, by its own odometry or by a motion-capture system.

    Args:
        pose: in the map's frame.
        twist: the velocity of its body at that instant.
    """

    version = 2

    pose: Pose
    twist: Twist = STILL


class SpeedLimit(Message, frozen=True, kw_only=True):
    """The top speed that the referee allows a robot in this match.

    Args:
        v_max: the top forward speed, m/s.
    """

    v_max: Annotated[float, Meta(gt=0.0, le=100.0)]


class CameraRequest(Message, frozen=True, kw_only=True):
    """A request for pictures of a robot's camera. A viewer sends it again before the lease ends.

    Args:
        lease: for how long the world takes pictures from when it hears this, s of match time.
    """

    lease: Annotated[float, Meta(gt=0.0, le=10.0)]


class Recover(Message, frozen=True, kw_only=True):
    """A request to a robot to clear the fault that it has latched, if it has one.

    Args:
        by: the official who asks for it.
    """

    by: Name


class Placed(Message, frozen=True, kw_only=True):
    """The pose where a person has put a physical robot. A robot that locates itself by odometry goes on from there.

    Args:
        pose: in the map's frame.
        by: the official who decided it.
    """

    pose: Pose
    by: Name
