"""The messages of players, and the commands of a human who drives a player's robot."""

import math
from typing import Annotated

from msgspec import Meta, Struct

from vrg.bus.messages.base import PLAIN, Message, Text
from vrg.types import Count, Deviation, Fraction, Metres, Name, Seconds, Signed, Twist

Drift = Annotated[float, Meta(ge=-1e4, le=1e4)]
"""The rate by which one clock runs faster than another, s per s."""
SAY_LIMIT = 1024
"""The number of bytes of MessagePack that a player may say to its team at one tick."""
CORRELATION = 0.999
"""The greatest correlation of the two coordinates of a sighting."""
LINKS_LIMIT = 100
"""The largest number of team mates in a player's report on the radio."""
SIGHTINGS_LIMIT = 20
"""The number of sightings that a player may tell the referee at one tick."""
STROKE_LIMIT = 200
"""The number of points in a stroke."""
SKETCH_LIMIT = 50
"""The number of strokes in a sketch."""


class Report(Message, frozen=True, kw_only=True):
    """The report of a player about itself.

    Args:
        mode: what its strategy does, such as the automaton's mode and submode, `Minnows/Cross`.
        armed: True if its robot's motors accept commands.
        manual: True while a person holds it; the referee's lease goes first.
        fault: what keeps it from playing, in words, without its name; None if nothing does.
        latched: True if its robot has latched a fault that only an official's `recover` clears.
        pressed: True if what has latched is an emergency stop that was pressed at the robot: a release clears it.
        estop: True if its device has latched the emergency stop.
        command: the motion that its robot was last commanded to make, after all limits; None while it is not driven.
        battery: the charge of its robot's battery, from 1 (full) to 0 (empty); None where that is not measured.
    """

    version = 6

    mode: Text
    armed: bool
    manual: bool = False
    fault: Text | None = None
    latched: bool = False
    pressed: bool = False
    estop: bool = False
    command: Twist | None = None
    battery: Fraction | None = None


class Manual(Message, frozen=True, kw_only=True):
    """A human's drive command, as fractions of what the robot can do, because its top speed is not published.

    Args:
        forward: from -1 (full speed back) to 1 (full speed ahead).
        turn: from -1 (fast to the right) to 1 (fast to the left).
        side: from -1 (full speed to the right) to 1 (full speed to the left), for a robot that can drive sideways.
        climb: from -1 (full speed down) to 1 (full speed up), for a robot that flies.
        lease: the match time for which the command holds, s, 0 to 1. 0 gives the robot back to its strategy.
    """

    version = 3

    forward: Signed
    turn: Signed
    side: Signed = 0.0
    climb: Signed = 0.0
    lease: Annotated[float, Meta(ge=0.0, le=1.0)]


class TeamOrder(Message, frozen=True, kw_only=True):
    """An order of the person who commands a team.

    Args:
        priority: the name of one of the game's priorities; None lets every player follow its own strategy.
        lease: the match time for which the order holds, s, 0 to 2. The commander repeats it.
    """

    priority: Name | None
    lease: Annotated[float, Meta(ge=0.0, le=2.0)]


class Say(Message, frozen=True, kw_only=True):
    """A message of a player to its team.

    Args:
        words: the MessagePack of the message of the player's strategy.
        place: where the player measured itself to be, m. The model of the radio needs it; strategies do not see it.
    """

    version = 2

    words: Annotated[bytes, Meta(max_length=SAY_LIMIT)]
    place: tuple[Metres, Metres] | None = None


class LinkCount(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The messages that a player has received over the radio from one team mate, since the player's program began.

    Args:
        speaker: the team mate. arrived, lost: the number of messages. under_way: those that are still to arrive.
        delay: the mean delay of those that arrived or are under way, match time, s. longest: the longest one, s.
    """

    speaker: Name
    arrived: Count
    lost: Count
    under_way: Count
    delay: Seconds
    longest: Seconds


class Links(Message, frozen=True, kw_only=True):
    """The messages that a player has received over the radio.

    Args:
        links: one for each team mate that has sent a message.
    """

    links: Annotated[tuple[LinkCount, ...], Meta(max_length=LINKS_LIMIT)]


VARIANCE_LIMIT = 100.0
"""The largest variance of a coordinate of a sighting, m^2."""
Variance = Annotated[float, Meta(ge=1e-6, le=VARIANCE_LIMIT)]
"""The variance of a coordinate, m^2."""
Covariance = Annotated[float, Meta(ge=-VARIANCE_LIMIT, le=VARIANCE_LIMIT)]
"""The covariance of two coordinates, m^2."""
Cost = Annotated[float, Meta(ge=0.0, le=1e6)]
"""The cost that a player bids."""


class Sighting(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A robot that a player has seen, but does not know.

    Args:
        x, y: where its centre was, m, in the map's frame. time: the match time of the measurement, s.
        xx, xy, yy: the covariance of x and y, m^2. The correlation must be less than CORRELATION.
    """

    x: Metres
    y: Metres
    time: Seconds
    xx: Variance
    xy: Covariance
    yy: Variance

    def __post_init__(self) -> None:
        if not (self.xx > 0.0 and self.yy > 0.0 and abs(self.xy) < CORRELATION * math.sqrt(self.xx * self.yy)):
            raise ValueError(
                f"xx, xy, yy: expected a positive definite covariance with a correlation below {CORRELATION}, "
                f"got {self.xx, self.xy, self.yy}"
            )


class Sightings(Message, frozen=True, kw_only=True):
    """The sightings of a player since its last tick, for the referee.

    Args:
        seen: the sightings.
    """

    seen: Annotated[tuple[Sighting, ...], Meta(max_length=SIGHTINGS_LIMIT)]


class Bid(Message, frozen=True, kw_only=True):
    """A player's bid in an auction of the referee.

    Args:
        lot: the name of what is auctioned.
        cost: what it would cost the player, such as the time in s until it meets an intruder: the lowest bid wins. None
            withdraws its bid, and gives the lot back if it has won it.
    """

    lot: Name
    cost: Cost | None


class Stroke(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A dot, if there is one point, or a line through all points.

    Args:
        points: (x, y) in the map's frame, m. label: a short text beside the last point.
    """

    points: Annotated[tuple[tuple[Metres, Metres], ...], Meta(min_length=1, max_length=STROKE_LIMIT)]
    label: Annotated[str, Meta(max_length=40, pattern=PLAIN)] = ""


class Sketch(Message, frozen=True, kw_only=True):
    """A picture of a player's thoughts for windows, recording and plot, until its next sketch.

    Args:
        strokes: the dots and lines.
    """

    strokes: Annotated[tuple[Stroke, ...], Meta(max_length=SKETCH_LIMIT)]


class Pulse(Message, frozen=True, kw_only=True):
    """A node's own sign of life. It shows that the node's thread still works, which a liveliness token does not.

    Args:
        ticks: the number of ticks done so far. missed: the number of ticks that were due but never done.
        frequency: how many ticks it has done in a second of real time since its last pulse.
        late: how much later than the fastest the match clock's messages have reached it since then, on average, s.
        drift: how much faster its own clock runs than the match clock, s per s. Both are None while they are not known;
            the world has neither.
        refused: the number of messages so far that came under a wrong key, or from a sender that may not publish there.
    """

    version = 3

    ticks: Count
    missed: Count
    frequency: Deviation = 0.0
    late: Seconds | None = None
    drift: Drift | None = None
    refused: Count = 0
