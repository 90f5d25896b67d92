"""The messages to a robot, and those about a robot besides its sensors' readings."""

import math
from collections.abc import Mapping
from typing import Annotated

from msgspec import Meta, Struct

from vrg.bus.messages.base import Message, Text, freeze
from vrg.types import STILL, FrozenDict, Name, Pose, Seconds, Twist, Uncertainty

LOST = 0.5
"""The time in s after which a robot, or a real thing, that nothing outside it has seen is lost."""
FIXES_LIMIT = 256
"""The number of robots and things that a source sees at an instant."""


class Drive(Message, frozen=True, kw_only=True):
    """The motion of a virtual robot until the next command.

    Args:
        twist: the motion.
        armed: False means that its motors must be off.
        use: what its actuators do, by their names; see `vrg.hal.actuators`.
    """

    version = 5

    twist: Twist
    armed: bool = True
    use: Mapping[Name, float] = FrozenDict()

    def __post_init__(self) -> None:
        freeze(self, "use")


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
    """The measured pose of a robot: by its own odometry, a motion-capture system, or the fusion centre; or of a thing.

    Args:
        pose: in the map's frame.
        twist: the velocity of its body at that instant.
        uncertainty: how well the pose is known; None if whatever measures it does not tell.
        unseen: the time since it was last seen from outside, s, if it must be: it is lost after LOST.
    """

    version = 4

    pose: Pose
    twist: Twist = STILL
    uncertainty: Uncertainty | None = None
    unseen: Seconds = 0.0

    @property
    def lost(self) -> bool:
        """True if nothing has seen the robot for so long that it is not known where it is."""
        return self.unseen > LOST


Latitude = Annotated[float, Meta(ge=-math.pi / 2, le=math.pi / 2)]
Longitude = Annotated[float, Meta(ge=-math.pi, le=math.pi)]


class OwnPlace(Struct, frozen=True, forbid_unknown_fields=True, gc=False):
    """The place of a robot as a sensor of its own has measured it: one of both is given.

    Args:
        stamp: when, match time, s.
        pose: in the map's frame, as of an inertial navigation system.
        earth: latitude and longitude, rad, WGS 84, as of a GPS receiver.
    """

    stamp: Seconds
    pose: Pose | None = None
    earth: tuple[Latitude, Longitude] | None = None


class Motion(Message, frozen=True, kw_only=True):
    """What a robot itself has measured of its motion, for the fusion centre.

    Args:
        odometry: its pose by its wheels, relative to where its odometry began. twist: the velocity of its body then.
        own: what it has newly measured of its place on the map or on the earth, if it has sensors for that.
    """

    version = 3

    odometry: Pose
    twist: Twist
    own: tuple[OwnPlace, ...] = ()


class Fix(Struct, frozen=True, forbid_unknown_fields=True, gc=False):
    """The pose of a robot, or of a thing such as a ball, as something outside it has measured it.

    Args:
        robot: the name of either. pose: in the map's frame.
        position: the standard deviation of x and of y, m. heading: that of the heading, rad; None if there is none.
        common: those of an error that all fixes of its source share now, so that it does not average out, m and rad.
    """

    robot: Name
    pose: Pose
    position: Annotated[float, Meta(gt=0.0, le=1e3)]
    heading: Annotated[float, Meta(gt=0.0, le=10.0)] | None = None
    common: tuple[Annotated[float, Meta(ge=0.0, le=1e3)], Annotated[float, Meta(ge=0.0, le=10.0)]] = (0.0, 0.0)


class Fixes(Message, frozen=True, kw_only=True):
    """What a source has seen at one instant: at most one fix of each robot and thing. The stamp is that of capture."""

    version = 2

    fixes: Annotated[tuple[Fix, ...], Meta(max_length=FIXES_LIMIT)]


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
    """The pose where a person has put a physical robot. A robot that locates itself by odometry continues from there.

    Args:
        pose: in the map's frame.
        by: the official who decided it.
    """

    pose: Pose
    by: Name
