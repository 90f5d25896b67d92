"""The messages of a recorded match, each with its match time, read in one pass.

A file that is torn, because its recorder was killed or its disk was full, is read as far as it goes.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from vrg.bus import messages as m
from vrg.names import name_of
from vrg.recording.mcap_reading import messages_in
from vrg.types import Twist

T = TypeVar("T")
Timed = list[tuple[float, T]]
"""Messages with the match time of each, s, in the order of time."""


@dataclass(frozen=True)
class RecordedMatch:
    """The messages of a match.

    Args:
        clocks: the clock of the world. poses: where every body was, at each instant that was recorded.
        states, calls, estops: the referee's state and calls, and the orders about the emergency stop.
        reports, sketches, sightings: of each player, by name.
        commands: the motion that each robot was commanded to make at each decision of its player, after all limits, by
            name.
        motions, measured: the odometry and the measured poses of each robot that is located so, by name.
        torn: the files of the recording that end in the middle, so that something is missing behind their end.
    """

    clocks: Timed[m.Clock] = field(default_factory=list)
    poses: Timed[m.Poses] = field(default_factory=list)
    states: Timed[m.RefereeState] = field(default_factory=list)
    calls: Timed[m.Call] = field(default_factory=list)
    estops: Timed[m.Estop | m.EstopRelease] = field(default_factory=list)
    reports: dict[str, Timed[m.Report]] = field(default_factory=dict)
    sketches: dict[str, Timed[m.Sketch]] = field(default_factory=dict)
    sightings: dict[str, Timed[m.Sightings]] = field(default_factory=dict)
    commands: dict[str, Timed[Twist]] = field(default_factory=dict)
    motions: dict[str, Timed[m.Motion]] = field(default_factory=dict)
    measured: dict[str, Timed[m.MeasuredPose]] = field(default_factory=dict)
    torn: list[Path] = field(default_factory=list)


def newest(entries: Timed[T], time: float) -> T | None:
    """The last message up to a match time, s; None if there is none."""
    count = bisect_right(entries, time, key=lambda entry: entry[0])
    return entries[count - 1][1] if count else None


def read_recorded(path: Path | Sequence[Path]) -> RecordedMatch:
    """Read all messages.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.

    Raises:
        OSError: a file cannot be read.
        MessageError: it is not a recording of this release.
    """
    match, numbers = RecordedMatch(), set[int]()
    by_name: dict[type[m.Message], dict[str, Timed[Any]]] = {
        m.Sketch: match.sketches, m.Sightings: match.sightings, m.Motion: match.motions, m.MeasuredPose: match.measured,
    }  # fmt: skip
    plain: dict[type[m.Message], Timed[Any]] = {
        m.Clock: match.clocks, m.RefereeState: match.states, m.Estop: match.estops, m.EstopRelease: match.estops,
    }  # fmt: skip
    for topic, stamp, message in messages_in(path, match.torn):
        match message:
            case m.Poses():
                _take_poses(match, message, stamp)
            case m.Call():
                # A referee that was started again may announce its last calls once more.
                if message.number not in numbers:
                    numbers.add(message.number)
                    match.calls.append((stamp, message))
            case m.Report():
                name = name_of(topic.split("/")[2])
                match.reports.setdefault(name, []).append((stamp, message))
                if message.command is not None:
                    match.commands.setdefault(name, []).append((stamp, message.command))
            case _ if (named := by_name.get(type(message))) is not None:
                named.setdefault(name_of(topic.split("/")[2]), []).append((stamp, message))
            case _ if (entries := plain.get(type(message))) is not None:
                entries.append((stamp, message))
    for entries in (*_happened(match), *_published(match)):
        entries.sort(key=lambda entry: entry[0])
    return match


def _take_poses(match: RecordedMatch, poses: m.Poses, stamp: float) -> None:
    """Take in where bodies were at a match time. A world that continues from a snapshot steps back to that.

    Where bodies were beyond it did not happen, nor what they were commanded and measured. Other messages beyond it were
    received: they count from then on.
    """
    if match.poses and stamp < match.poses[-1][0]:
        for entries in _happened(match):
            # Some of the time after it may have been written before the poses.
            steps = (n for n in range(1, len(entries)) if entries[n][0] < entries[n - 1][0] > stamp)
            first = next(steps, len(entries))
            entries[:first] = [entry for entry in entries[:first] if entry[0] < stamp]
        for entries in _published(match):
            for index, (time, message) in enumerate(entries):
                entries[index] = (min(time, stamp), message)
    while match.poses and match.poses[-1][0] >= stamp:
        match.poses.pop()
    match.poses.append((stamp, poses))


def _happened(match: RecordedMatch) -> list[Timed[Any]]:
    """What robots and the world did, which a world that steps back does take back."""
    by_name = (match.commands, match.motions, match.measured)
    return [match.clocks, *(entries for of in by_name for entries in of.values())]


def _published(match: RecordedMatch) -> list[Timed[Any]]:
    """What senders have published that a world which steps back does not take back."""
    by_player = (match.reports, match.sketches, match.sightings)
    return [match.states, match.calls, match.estops, *(entries for of in by_player for entries in of.values())]
