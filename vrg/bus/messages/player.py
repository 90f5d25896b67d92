"""The messages of players, and the commands of a human who drives a player's robot."""

from typing import Annotated

from msgspec import Meta

from vrg.bus.messages.base import Message, Text
from vrg.types import Count, Fraction, Signed, Twist

SAY_LIMIT = 1024
"""The number of bytes of MessagePack that a player may say to its team at one tick."""


class Report(Message, frozen=True, kw_only=True):
    """The report of a player about itself.

    Args:
        mode: what its strategy does, such as the automaton's mode and submode, `Minnows/Cross`.
        armed: True if its robot's motors accept commands.
        manual: True while a human holds the lease.
        fault: what keeps it from playing, in words; None if nothing does.
        latched: True if its robot has latched a fault that only an official's `recover` clears.
        estop: True if its device has latched the emergency stop.
        command: the motion that its robot was last told to make, after all limits; None while it is not driven.
        battery: the charge of its robot's battery, from 1 (full) to 0 (empty); None where that is not measured.
    """

    version = 4

    mode: Text
    armed: bool
    manual: bool = False
    fault: Text | None = None
    latched: bool = False
    estop: bool = False
    command: Twist | None = None
    battery: Fraction | None = None


class Manual(Message, frozen=True, kw_only=True):
    """A human's drive command, as fractions of what the robot can do, because its top speed is not published.

    Args:
        forward: from -1 (full speed back) to 1 (full speed ahead).
        turn: from -1 (fast to the right) to 1 (fast to the left).
        lease: the match time for which the command holds, s, 0 to 1. 0 gives the robot back to its strategy.
    """

    forward: Signed
    turn: Signed
    lease: Annotated[float, Meta(ge=0.0, le=1.0)]


class Say(Message, frozen=True, kw_only=True):
    """What a player says to its team.

    Args:
        words: the MessagePack of what the player's strategy has said.
    """

    words: Annotated[bytes, Meta(max_length=SAY_LIMIT)]


class Pulse(Message, frozen=True, kw_only=True):
    """A node's own sign of life. It shows that the node's thread still works, which a liveliness token does not.

    Args:
        ticks: the number of ticks done so far. missed: the number of ticks that were due but never done.
    """

    ticks: Count
    missed: Count
