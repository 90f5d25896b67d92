"""Measures the stops of robots after incidents: their duration, and the distance rolled. This module reads no files.

A robot stands if its speed is not above `vrg.bus.messages.AT_REST` for at least REST_TIME, so that one that only
changes its direction does not count as standing.
"""

import bisect
import enum
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from vrg.portable.scalars import total

REST_TIME = 0.2
"""The match time in s for which a robot must be at rest before it counts as standing."""
MAX_POSE_INTERVAL = 0.35
"""The match time in s between two known places of a robot above which its path between them is not known."""
_TINY = 1e-6
"""The match time in s below which two instants are the same."""


@dataclass(frozen=True)
class Rest:
    """A time during which a robot was at rest.

    Args:
        begin, end: match time, s; `end` is infinite where it goes on to the end of the recording.
        resolution: the time in s before `begin` in which it may have come to rest already.
    """

    begin: float
    end: float = math.inf
    resolution: float = 0.0


@dataclass(frozen=True)
class Trajectory:
    """The motion of one robot.

    Args:
        name: the robot. physical: True for a physical one.
        times: match time, s, rising. x, y: its place then, m. v: its speed then, m/s.
        rests: the times during which it was at rest, in order; they do not overlap.
    """

    name: str
    physical: bool = False
    times: Sequence[float] = ()
    x: Sequence[float] = ()
    y: Sequence[float] = ()
    v: Sequence[float] = ()
    rests: Sequence[Rest] = ()

    def place(self, time: float) -> tuple[float, float]:
        """Its place at a match time between the first and the last, m: on the line between two known places."""
        after = min(bisect.bisect_left(self.times, time), len(self.times) - 1)
        if self.times[after] <= time or after == 0:
            return self.x[after], self.y[after]
        begin, end = self.times[after - 1], self.times[after]
        for rest in self.rests:
            # Where it is at rest it does not move, so that all of the way lies before or after.
            if rest.begin <= time + _TINY and rest.end >= end - _TINY:
                return self.x[after], self.y[after]
            if rest.begin <= begin + _TINY and rest.end >= time - _TINY:
                return self.x[after - 1], self.y[after - 1]
            if begin < rest.begin < end <= rest.end + _TINY:
                end = rest.begin
            elif rest.begin <= begin < rest.end < end:
                begin = rest.end
        share = 1.0 if end <= begin else min(1.0, max(0.0, (time - begin) / (end - begin)))
        return (
            self.x[after - 1] + share * (self.x[after] - self.x[after - 1]),
            self.y[after - 1] + share * (self.y[after] - self.y[after - 1]),
        )

    def path(self, begin: float, end: float) -> list[tuple[float, float, float]]:
        """The known places, as (match time, x, y), from `begin` to `end`, with its places at both."""
        first, last = bisect.bisect_right(self.times, begin), bisect.bisect_left(self.times, end)
        between = [(self.times[i], self.x[i], self.y[i]) for i in range(first, last)]
        return [(begin, *self.place(begin)), *between, (end, *self.place(end))]

    def rests_at(self, time: float) -> bool:
        """True if it was at rest at a match time, as far as is known."""
        return any(rest.begin <= time + _TINY and time < rest.end - _TINY for rest in self.rests)

    def speed(self, time: float) -> float:
        """The amount of its speed at the last known instant at or before a match time, m/s; 0 before the first."""
        at = bisect.bisect_right(self.times, time + _TINY) - 1
        return abs(self.v[at]) if at >= 0 else 0.0


def rests_of(times: Sequence[float], resting: Iterable[bool]) -> list[Rest]:
    """The times of rest of a robot of which is only known at some instants whether it was at rest.

    Args:
        times: match time, s, rising. resting: whether it was at rest then.
    """
    found: list[Rest] = []
    begin: float | None = None
    before: float | None = None
    resolution = 0.0
    for time, rests in zip(times, resting, strict=True):
        if rests and begin is None:
            begin, resolution = time, 0.0 if before is None else time - before
        elif not rests and begin is not None:
            found.append(Rest(begin, time, resolution))
            begin = None
        before = time
    return found if begin is None else [*found, Rest(begin, math.inf, resolution)]


class IncidentKind(enum.StrEnum):
    """The kinds of incidents."""

    HALT = "halt"
    ESTOP = "estop"
    DEATH = "death"
    AWAY = "away"


@dataclass(frozen=True)
class Incident:
    """Something after which robots must stop.

    Args:
        kind: what kind of incident. what: what happened, in words.
        time: the match time of it, s. After a death it is that of the last message of the dead process, if that is
            known; of a machine that is away, that of the last message of its processes.
        until: the match time at which play went on, s; infinite if it did not.
        soonest: the match time from which play may have gone on, s, where `until` only tells when that was noticed;
            infinite where `until` is exact.
        process: the process that has died, or the machine that is away; None if there is none.
        timeless: True if match time stood after it, as the world or the router was gone.
        robots: the robots that must stop; None means all.
        resolution: the time in s by which it may have been earlier.
    """

    kind: IncidentKind
    what: str
    time: float
    until: float = math.inf
    soonest: float = math.inf
    process: str | None = None
    timeless: bool = False
    robots: frozenset[str] | None = None
    resolution: float = 0.0


class StopOutcome(enum.StrEnum):
    """The outcome of an incident for one robot."""

    STOOD = "stood already"
    STOPPED = "stopped"
    MOVED_AGAIN = "moved again before play went on"
    PLAYED_ON = "did not stand before play went on"
    CUT = "still moved when the recording ended"
    UNKNOWN = "is not known"


_STILL = 0.005
"""The way in m, and the speed in m/s, below which nothing shows that a robot has moved."""


@dataclass(frozen=True)
class RobotStop:
    """The stop of one robot after an incident.

    Args:
        incident: the number of the incident in the list, from 0. robot: the robot.
        outcome: how it went on. `seconds` and `distance` are up to the stop, or as far as is known. For a robot that
            moved again they are up to the last time that it stood before play went on.
        seconds: the time from the incident until it stood, s.
        distance: the length of its path in that time, m.
        speed: its speed at the incident, m/s.
        resolution: the time in s by which `seconds` may be wrong.
        gap: the longest time in s in which its path is not known; the distance may then be longer.
        again: the time from the incident until it moved again before play went on, s; None if it did not.
        real: True if these times are real time, because match time stood; False for match time.
    """

    incident: int
    robot: str
    outcome: StopOutcome
    seconds: float = 0.0
    distance: float = 0.0
    speed: float = 0.0
    resolution: float = 0.0
    gap: float = 0.0
    again: float | None = None
    real: bool = False

    @property
    def moved(self) -> bool:
        """True if it moved when the incident happened, or after it had stood."""
        return self.outcome not in (StopOutcome.STOOD, StopOutcome.UNKNOWN)


def stops_of(incidents: Sequence[Incident], motions: Sequence[Trajectory]) -> list[RobotStop]:
    """The stop of each robot after each incident, in the order of the incidents and of the names."""
    ordered = sorted(motions, key=lambda motion: motion.name)
    return [
        stop_of(number, incident, motion)
        for number, incident in enumerate(incidents)
        for motion in ordered
        if incident.robots is None or motion.name in incident.robots
    ]


def stop_of(number: int, incident: Incident, motion: Trajectory) -> RobotStop:
    """The stop of one robot after one incident.

    Args:
        number: the number of the incident.
    """
    onset, until = incident.time, incident.until
    if not motion.times or not motion.times[0] - MAX_POSE_INTERVAL <= onset <= motion.times[-1] + MAX_POSE_INTERVAL:
        return RobotStop(number, motion.name, StopOutcome.UNKNOWN)
    onset = min(max(onset, motion.times[0]), motion.times[-1])
    last = max(onset, min(until, motion.times[-1]))
    again: float | None = None
    stands = _stands(motion, onset, last)
    first = stands[0] if stands else None
    if first is not None and _moves(motion, first.end, min(until, incident.soonest)):
        again = first.end - onset
        # Where it did not stand any more, it moved up to the end.
        final = stands[-1] if len(stands) > 1 else Rest(last)
        end, outcome, resolution = final.begin, StopOutcome.MOVED_AGAIN, final.resolution
    elif first is None:
        end, outcome, resolution = last, StopOutcome.PLAYED_ON if until <= motion.times[-1] else StopOutcome.CUT, 0.0
    elif first.begin < onset - _TINY:
        return RobotStop(number, motion.name, StopOutcome.STOOD)
    else:
        end, outcome, resolution = first.begin, StopOutcome.STOPPED, first.resolution
    path = motion.path(onset, end)
    distance = total(math.dist(a[1:], b[1:]) for a, b in itertools.pairwise(path))
    if first is None and distance < _STILL and motion.speed(onset) < _STILL:
        # Its measurements came too late to call it at rest, but none of them shows that it moved.
        return RobotStop(number, motion.name, StopOutcome.UNKNOWN)
    return RobotStop(
        number,
        motion.name,
        outcome,
        seconds=end - onset,
        distance=distance,
        speed=motion.speed(onset),
        resolution=resolution + incident.resolution,
        gap=_gap(motion, onset, end),
        again=again,
    )


def _stands(motion: Trajectory, onset: float, last: float) -> list[Rest]:
    """The times for which the robot stands, of those that end after `onset` and begin before `last`, in order."""
    return [
        rest
        for rest in motion.rests
        if rest.end > onset + _TINY and rest.begin <= last + _TINY
        if rest.end - max(rest.begin, onset) >= REST_TIME - _TINY or rest.end >= last - _TINY
    ]


def _moves(motion: Trajectory, rest: float, before: float) -> bool:
    """True if it is known that a robot that was at rest up to one match time moved before another one.

    From its last known place at rest to the next known one it is not known when it began to move.
    """
    after = bisect.bisect_right(motion.times, rest + _TINY)
    seen = after < len(motion.times) and motion.times[after] < before - _TINY
    return seen or any(rest - _TINY <= other.begin < before - _TINY for other in motion.rests)


def _gap(motion: Trajectory, begin: float, end: float) -> float:
    """The longest time in s between two known places around and within a span of time; 0 up to MAX_POSE_INTERVAL."""
    first = max(0, bisect.bisect_right(motion.times, begin) - 1)
    last = min(len(motion.times) - 1, bisect.bisect_left(motion.times, end))
    longest = max((motion.times[i + 1] - motion.times[i] for i in range(first, last)), default=0.0)
    return longest if longest > MAX_POSE_INTERVAL else 0.0


def worst(stops: Iterable[RobotStop]) -> RobotStop | None:
    """The stop that took the longest; of equal ones that of the longest path. None if no robot moved.

    A robot that moved again is worse than any other: what had stopped it no longer held it.
    """
    moved = [stop for stop in stops if stop.moved]
    return max(moved, key=lambda stop: (stop.again is not None, stop.seconds, stop.distance), default=None)
