"""What the world says and what it can be asked for."""

import enum
from typing import Annotated

from msgspec import Meta, Struct

from vrg.bus.messages.base import Message
from vrg.types import AngularSpeed, Count, Name, Pose, Seconds, Speed


class Clock(Message, frozen=True, kw_only=True):
    """Match time.

    Args:
        time: s since the world began.
        tick: number of world ticks since then.
        epoch: rises by one each time the world restarts from a snapshot, when time may step back a little.
        rate: match seconds per real second that the world aims for; 0 = as fast as it can.
        estop: the world's own latch of the emergency stop.
    """

    time: Seconds
    tick: Count
    epoch: Count
    rate: Annotated[float, Meta(ge=0.0, le=1e4)]
    estop: bool


class Body(Struct, frozen=True, forbid_unknown_fields=True):
    """One body in the world.

    Args:
        v, w: speed along its own x axis, m/s, and yaw rate, rad/s.
        physical: it is a physical robot, which the world shows where it was measured.
        age: s of match time since it was measured; 0 for a virtual body.
    """

    name: Name
    pose: Pose
    v: Speed
    w: AngularSpeed
    physical: bool
    age: Seconds = 0.0


class Poses(Message, frozen=True, kw_only=True):
    """Every body at one instant."""

    version = 2

    bodies: list[Body]


class RequestKind(enum.StrEnum):
    """What the world can be asked for."""

    SPAWN = "spawn"
    REMOVE = "remove"
    RESET = "reset"
    PLACE = "place"


class WorldRequest(Message, frozen=True, kw_only=True):
    """A change to the world.

    Args:
        kind: spawn a robot of `model` at `pose`; remove it; reset it to its start pose (all of them without a
            name); place robots at `places`, all of them or none.
    """

    kind: RequestKind
    robot: Name | None = None
    model: Name | None = None
    pose: Pose | None = None
    places: dict[Name, Pose] = {}
