"""The messages of the world, and the requests to it."""

from collections.abc import Mapping
from typing import Annotated

from msgspec import Meta, Struct

from vrg.bus.messages.base import Message, Text, freeze
from vrg.portable.scalars import hypot
from vrg.types import AngularSpeed, Count, Name, Pose, Seconds, Speed, Twist, Uncertainty


class Clock(Message, frozen=True, kw_only=True):
    """The match time, published at each tick of the world.

    Args:
        time: the time since the world began, s.
        tick: the number of world ticks since then.
        epoch: rises by one each time the world restarts from a snapshot; time may then step back a little.
        rate: the match seconds per real second that the world aims for; 0 means as fast as possible.
        estop: True if the world has latched the emergency stop.
    """

    time: Seconds
    tick: Count
    epoch: Count
    rate: Annotated[float, Meta(ge=0.0, le=1e4)]
    estop: bool


AT_REST = 0.05
"""The speed in m/s and rad/s at or below which a body counts as at rest."""
LIES = 0.15
"""The speed in m/s at or below which a thing lies where it is: that of a real one is measured, with noise."""


def at_rest(twist: Twist) -> bool:
    """True if a body that moves so is at rest."""
    if abs(twist.v) > AT_REST or abs(twist.w) > AT_REST:
        return False
    return abs(twist.side) <= AT_REST and abs(twist.climb) <= AT_REST


class Body(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, gc=False):
    """One body in the world.

    Args:
        twist: its velocity, in its own frame.
        physical: True for a physical robot, which the world shows where it was measured.
        age: the match time since it was measured, s; 0 for a virtual body.
        rest: the match time of the tick since which it has been at rest, s; None while it moves, or while a physical
            robot has not been measured for so long that it is not known. A node that receives only some of the poses
            knows by it to a tick when the body came to rest.
        stands: the match time of the tick since which the wheels of a virtual robot are held or commanded to stand, s;
            None while they are commanded to turn, and of a physical robot. A robot that moves nevertheless is pushed.
        uncertainty: how well the pose of a physical robot is known; None if that is not known.
    """

    name: Name
    pose: Pose
    twist: Twist
    physical: bool
    age: Seconds = 0.0
    rest: Seconds | None = None
    stands: Seconds | None = None
    uncertainty: Uncertainty | None = None


class Thing(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, gc=False):
    """A passive body of the world, such as a ball.

    Args:
        pose: that of its centre of mass, in the map's frame.
        vx, vy: its velocity in the map's frame, m/s. w: its turn rate, rad/s.
        lost: True if it is a real one that no source has seen for LOST; it is then where it was seen last.
    """

    name: Name
    pose: Pose
    vx: Speed = 0.0
    vy: Speed = 0.0
    w: AngularSpeed = 0.0
    lost: bool = False

    @property
    def lies(self) -> bool:
        """True if it is seen and moves no faster than LIES."""
        return not self.lost and hypot(self.vx, self.vy) <= LIES


class Poses(Message, frozen=True, kw_only=True):
    """The poses and velocities of all robots at one instant, as `bodies`, and those of all passive bodies."""

    version = 9

    bodies: tuple[Body, ...]
    things: tuple[Thing, ...] = ()


class WorldRequest(Message, frozen=True, kw_only=True):
    """A request to put virtual robots and passive bodies somewhere else, at rest: as many as there is room for.

    Args:
        id: the world's answer repeats it. None if the asker wants to hear of a refusal only.
        places: the pose of each of these, by name.
    """

    version = 2

    id: Name | None = None
    places: Mapping[Name, Pose]

    def __post_init__(self) -> None:
        freeze(self, "places")


class WorldAnswer(Message, frozen=True, kw_only=True):
    """The world's answer to a request.

    Args:
        id: the id of the request; None if it had none.
        refused: the reason why it was not granted, or for which robots not; None if it was granted.
    """

    id: Name | None
    refused: Text | None
