"""Turns a recording back into what the windows of the match heard: messages, each with its match time."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, TypeVar

from msgspec import UNSET
from msgspec.structs import replace

from vrg.bus import messages as m
from vrg.errors import MessageError
from vrg.recording.foxglove import PoseInFrame, SceneUpdate, heading_of
from vrg.recording.mcap_reading import decode, records_in
from vrg.recording.records import BatteryRecord, CallRecord, EstopRecord, ReportRecord, StateRecord, TwistRecord
from vrg.recording.sketches import strokes_of
from vrg.types import STILL, Pose, Twist

T = TypeVar("T")
Timed = list[tuple[float, T]]
"""Messages with the match time of each, s, in the order of time."""

_RADIUS: Final = 0.5
"""m; a recording does not tell the radius within which a player is reached, and no window shows it."""


@dataclass(frozen=True)
class RecordedMatch:
    """The messages of a match.

    Args:
        poses: where every body was, at each instant that was recorded.
        states, calls, estops: the referee's state and calls, and the orders about the emergency stop.
        reports, sketches: of each player, by name.
        commands: the motion that each robot was commanded to make at each decision of its player, after all limits, by
            name.
        leases: False if a state does not tell whom the referee drove, as in recordings of older releases.
        torn: the files of the recording that end in the middle, so that something is missing behind their end.
    """

    poses: Timed[m.Poses] = field(default_factory=list)
    states: Timed[m.RefereeState] = field(default_factory=list)
    calls: Timed[m.Call] = field(default_factory=list)
    estops: Timed[m.Estop | m.EstopRelease] = field(default_factory=list)
    reports: dict[str, Timed[m.Report]] = field(default_factory=dict)
    sketches: dict[str, Timed[m.Sketch]] = field(default_factory=dict)
    commands: dict[str, Timed[Twist]] = field(default_factory=dict)
    leases: bool = True
    torn: list[Path] = field(default_factory=list)


def read_recorded(path: Path | Sequence[Path]) -> RecordedMatch:
    """Read all messages.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.

    Raises:
        OSError: a file cannot be read.
        MessageError: it is not a recording of this program, or of another version of it.
    """
    reading = _Reading()
    for topic, metadata, stamp, data in records_in(path, reading.match.torn):
        reading.take(topic, stamp, data, physical=metadata.get("physical") == "true")
    return reading.sorted()


class _Reading:
    """Collects the messages, one record after the other."""

    def __init__(self) -> None:
        self.match = RecordedMatch()
        self._bodies: dict[str, m.Body] = {}
        """Those of the instant that is being read; the record `/scene` ends it."""
        self._charge: dict[str, float] = {}
        self._zones: tuple[m.Zone, ...] = ()
        self._numbers: set[int] = set()
        self._leases = True

    def sorted(self) -> RecordedMatch:
        """Everything, in the order of time. Messages of the same time keep their order."""
        for entries in self._said():
            entries.sort(key=lambda entry: entry[0])
        return dataclasses.replace(self.match, leases=self._leases)

    def take(self, topic: str, stamp: float, data: bytes, *, physical: bool) -> None:
        """Take one record in; `physical` tells that its topic is of a physical robot."""
        match topic.split("/"):
            case ["", "robot", name, "pose"]:
                pose = decode(data, PoseInFrame, topic).pose
                place = Pose(pose.position.x, pose.position.y, heading_of(pose.orientation))
                self._bodies[name] = m.Body(name=name, pose=place, twist=STILL, physical=physical)
            case ["", "robot", name, "twist"] if name in self._bodies:
                self._bodies[name] = replace(self._bodies[name], twist=decode(data, TwistRecord, topic).twist)
            case ["", "robot", name, "command"]:
                twist = decode(data, TwistRecord, topic).twist
                self.match.commands.setdefault(name, []).append((stamp, twist))
            case ["", "scene"]:
                self._end_instant(stamp)
            case ["", "referee", "state"]:
                self.match.states.append((stamp, self._state(decode(data, StateRecord, topic))))
            case ["", "referee", "event"]:
                self._take_call(decode(data, CallRecord, topic), stamp)
            case ["", "estop"]:
                order = decode(data, EstopRecord, topic)
                kind = m.Estop if order.engaged else m.EstopRelease
                self.match.estops.append((stamp, kind(by=order.by, reason=order.reason)))
            case ["", "player", name, "report"]:
                self._take_report(name, decode(data, ReportRecord, topic), stamp)
            case ["", "robot", name, "battery"]:
                self._take_charge(name, decode(data, BatteryRecord, topic).charge, stamp)
            case ["", "player", name, "sketch"]:
                entities = decode(data, SceneUpdate, topic).entities
                sketch = m.Sketch(strokes=tuple(stroke for entity in entities for stroke in strokes_of(entity)))
                self.match.sketches.setdefault(name, []).append((stamp, sketch))

    def _end_instant(self, stamp: float) -> None:
        poses = self.match.poses
        if poses and stamp < poses[-1][0]:
            self._step_back(stamp)
        while poses and poses[-1][0] >= stamp:
            poses.pop()
        poses.append((stamp, m.Poses(bodies=tuple(self._bodies.values()))))
        self._bodies.clear()

    def _step_back(self, time: float) -> None:
        """Go back to a match time from which the world has begun again.

        Where bodies were beyond it did not happen, nor what they were commanded. Other messages beyond it were
        received: they count from then on.
        """
        for commands in self.match.commands.values():
            while commands and commands[-1][0] >= time:
                commands.pop()
        for entries in self._said():
            _bring_forward(entries, time)

    def _said(self) -> list[Timed[Any]]:
        """Everything but the poses and the commands."""
        match = self.match
        return [match.states, match.calls, match.estops, *match.reports.values(), *match.sketches.values()]

    def _take_call(self, record: CallRecord, stamp: float) -> None:
        # A referee that was started again may announce its last calls once more.
        if record.number in self._numbers:
            return
        self._numbers.add(record.number)
        call = m.Call(
            number=record.number, rule=record.rule, text=record.text, players=record.players, poses=record.poses,
            clock=record.clock, why=record.why, cause=record.cause,
        )  # fmt: skip
        self.match.calls.append((stamp, call))

    def _take_report(self, name: str, record: ReportRecord, stamp: float) -> None:
        report = m.Report(
            mode=record.mode, armed=record.armed, manual=record.manual, fault=record.fault or None,
            latched=record.latched, estop=record.estop, battery=self._charge.get(name),
        )  # fmt: skip
        self.match.reports.setdefault(name, []).append((stamp, report))

    def _take_charge(self, name: str, charge: float, stamp: float) -> None:
        self._charge[name] = charge
        entries = self.match.reports.get(name)
        # Before the first report this waits for it, as it was a part of it.
        if entries:
            entries.append((stamp, replace(entries[-1][1], battery=charge)))

    def _state(self, record: StateRecord) -> m.RefereeState:
        if record.zones != self._zones:
            self._zones = record.zones
        self._leases &= not any(p.lease is UNSET for p in record.players)
        return m.RefereeState(
            game=record.game, stage=_stage(record.stage), halted=record.halted or None,
            way_out=record.way_out or None, waiting=record.waiting, clock=record.clock, total=record.total,
            round=record.round, rounds=record.rounds, score=record.score,
            players=tuple(
                m.PlayerStatus(
                    name=p.name, team=p.team, role=p.role, state=p.state, may_move=p.may_move, radius=_RADIUS,
                    mark=p.mark[0] if p.mark else None, lease=p.lease[0] if p.lease else None,
                )
                for p in record.players
            ),
            zones=self._zones, auctions=record.auctions, objects=record.objects, numbers=record.numbers,
            winner=record.winner or None, ended=record.ended or None, estop=record.estop,
            unproved=record.unproved,
        )  # fmt: skip


def _stage(word: str) -> m.Stage:
    try:
        return m.Stage(word)
    except ValueError:
        raise MessageError(f"/referee/state: stage: expected one of {', '.join(m.Stage)}, got {word!r}") from None


def _bring_forward(entries: Timed[T], time: float) -> None:
    """Give messages after a match time that match time."""
    for index in range(len(entries) - 1, -1, -1):
        stamp, message = entries[index]
        if stamp > time:
            entries[index] = (time, message)
