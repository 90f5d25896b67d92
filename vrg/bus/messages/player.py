"""What players say, and what is said to them by hand."""

from typing import Annotated

from msgspec import Meta

from vrg.bus.messages.base import Message, Text
from vrg.types import Count, Signed

SAY_LIMIT = 1024
"""bytes of MessagePack that a player may say to its team at one tick."""


class Report(Message, frozen=True, kw_only=True):
    """What a player says of itself.

    Args:
        mode: the automaton's mode and submode, such as `Minnow/Cross`.
        armed: its robot's motors accept commands.
        manual: a human holds the lease.
        fault: what keeps it from playing, in words.
        latched: its robot has latched a fault that only an official's `recover` clears.
        estop: its robot has latched the emergency stop.
    """

    version = 3

    mode: Text
    armed: bool
    manual: bool = False
    fault: Text | None = None
    latched: bool = False
    estop: bool = False


class Manual(Message, frozen=True, kw_only=True):
    """A human's drive command, as fractions of what the robot can do; nobody is told its top speed.

    Args:
        forward: -1 full back to 1 full ahead.
        turn: -1 full right to 1 full left.
        lease: s of match time for which it holds; at most 1. 0 gives the player back to itself.
    """

    forward: Signed
    turn: Signed
    lease: Annotated[float, Meta(ge=0.0, le=1.0)]


class Say(Message, frozen=True, kw_only=True):
    """What a player says to its team.

    Args:
        words: MessagePack of whatever the player's strategy has said.
    """

    words: Annotated[bytes, Meta(max_length=SAY_LIMIT)]


class Pulse(Message, frozen=True, kw_only=True):
    """A node's own sign of life: its thread of work goes on, which a liveliness token does not tell.

    Args:
        ticks: done so far. missed: due but never done.
    """

    ticks: Count
    missed: Count
