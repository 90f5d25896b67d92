"""Reads a recording back: where each robot was, and what the referee called.

A file that is torn, because its recorder was killed or its disk was full, is read as far as it goes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from vrg.bus.messages import FieldObject, Sighting, Stage, Stroke, Zone, at_rest
from vrg.recording.foxglove import PoseInFrame, SceneUpdate, heading_of
from vrg.recording.mcap_reading import decode, records_in
from vrg.recording.records import CallRecord, EstopRecord, RestRecord, SightingsRecord, StateRecord, TwistRecord
from vrg.recording.sketches import strokes_of
from vrg.recording.stops import MAX_POSE_INTERVAL, Rest, Trajectory, rests_of
from vrg.types import STILL, Twist


@dataclass(frozen=True)
class RobotPoses:
    """The recorded poses of one robot.

    Args:
        physical: a real robot, not a virtual one.
        times: match time, s, rising. x, y: m. theta: rad, -pi to pi. All of shape (n,).
        roles, states: the referee's words at each time; empty before it spoke.
        rounds: the round at each time, 0 before the first; shape (n,).
        playing: whether a round was being played, and not prepared or over; shape (n,).
    """

    name: str
    physical: bool
    times: npt.NDArray[np.float64]
    x: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    theta: npt.NDArray[np.float64]
    roles: list[str]
    states: list[str]
    rounds: npt.NDArray[np.int64]
    playing: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Setting:
    """The match of a recording, and its place.

    Args:
        game: its name, empty where the referee never spoke.
        zones: of each round that was begun, by its number, as they were while it was played.
        objects: the things of the game that are no robots, as the referee last published them.
    """

    game: str
    zones: dict[int, tuple[Zone, ...]]
    objects: Sequence[FieldObject] = ()


_Referee = tuple[str, str, int, bool]
"""The referee's last state of a player: its role, its state, the round, and whether that is being played."""


@dataclass
class _Samples:
    physical: bool
    poses: list[tuple[float, float, float, float]] = field(default_factory=list)
    referee: list[_Referee] = field(default_factory=list)

    def add(self, time: float, record: PoseInFrame, said: _Referee) -> None:
        # After a restart from a snapshot time steps back: what was recorded beyond it did not happen.
        while self.poses and self.poses[-1][0] >= time:
            self.poses.pop()
            self.referee.pop()
        position = record.pose.position
        self.poses.append((time, position.x, position.y, heading_of(record.pose.orientation)))
        self.referee.append(said)


def read_tracks(path: Path | Sequence[Path], torn: list[Path] | None = None) -> dict[str, RobotPoses]:
    """Read each robot's track, by name.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.
        torn: where to note the files that end in the middle.

    Raises:
        OSError: the file cannot be read.
        MessageError: it is not a recording of this program.
    """
    samples: dict[str, _Samples] = {}
    roles: dict[str, tuple[str, str]] = {}
    match = (0, False)
    for topic, metadata, stamp, data in records_in(path, torn):
        if topic == "/referee/state":
            state = decode(data, StateRecord, topic)
            roles = {p.name: (p.role, p.state) for p in state.players}
            match = (state.round, state.stage == Stage.PLAY_ROUND)
        elif (name := _robot_of_pose(topic)) is not None:
            if name not in samples:
                samples[name] = _Samples(metadata.get("physical") == "true")
            samples[name].add(stamp, decode(data, PoseInFrame, topic), (*roles.get(name, ("", "")), *match))
    return {name: _track(name, of) for name, of in samples.items()}


def read_calls(path: Path | Sequence[Path]) -> list[CallRecord]:
    """Read the referee's calls in the order of their numbers. Argument and errors are those of `read_tracks`."""
    topic = "/referee/event"
    calls = [decode(data, CallRecord, topic) for at, _, _, data in records_in(path) if at == topic]
    return sorted(calls, key=lambda call: call.number)


def read_setting(path: Path | Sequence[Path]) -> Setting:
    """Read the game and its field. Argument and errors are those of `read_tracks`."""
    game = ""
    zones: dict[int, tuple[Zone, ...]] = {}
    objects: tuple[FieldObject, ...] = ()
    for topic, _, _, data in records_in(path):
        if topic == "/referee/state":
            state = decode(data, StateRecord, topic)
            game = state.game
            if state.stage == Stage.PLAY_ROUND or state.round not in zones:
                zones[state.round] = state.zones
            objects = state.objects
    return Setting(game, zones, objects)


@dataclass(frozen=True)
class Thought:
    """A sketch of a player.

    Args:
        player: its name. time: match time, s. strokes: the dots and lines.
    """

    player: str
    time: float
    strokes: list[Stroke]


def read_sightings(path: Path | Sequence[Path]) -> dict[str, list[Sighting]]:
    """Read the sightings that each player has reported. Argument and errors are those of `read_tracks`."""
    found: dict[str, list[Sighting]] = {}
    for topic, _, _, data in records_in(path):
        match topic.split("/"):
            case ["", "player", name, "sightings"]:
                found.setdefault(name, []).extend(decode(data, SightingsRecord, topic).seen)
    return found


def read_sketches(path: Path | Sequence[Path]) -> list[Thought]:
    """Read what players have sketched, in the order of time. Argument and errors are those of `read_tracks`."""
    found = []
    for topic, _, stamp, data in records_in(path):
        match topic.split("/"):
            case ["", "player", name, "sketch"]:
                entities = decode(data, SceneUpdate, topic).entities
                found.append(Thought(name, stamp, [s for entity in entities for s in strokes_of(entity)]))
    return sorted(found, key=lambda thought: thought.time)


SAME_PLACE = 1e-6
"""The distance in m below which two places are the same: no robot comes back to where it was so exactly."""
MEASURED_PLACE = 0.03
"""The distance in m below which two places of a physical robot are the same, as far as fixes tell."""


@dataclass
class _Moves:
    """The motion of one robot in a recording: places, velocities, and the times at which it came to rest or moved."""

    physical: bool
    places: list[tuple[float, float, float]] = field(default_factory=list)
    twists: list[tuple[float, Twist]] = field(default_factory=list)
    rests: list[tuple[float, RestRecord, bool]] = field(default_factory=list)
    """Each record with its match time, and whether the robot was seen shortly before, or before at the same place."""

    def step_back(self, time: float) -> None:
        """Drop what was recorded beyond a match time to which the world has stepped back: it did not happen."""
        while self.places and self.places[-1][0] >= time:
            self.places.pop()
        while self.twists and self.twists[-1][0] >= time:
            self.twists.pop()
        while self.rests and self.rests[-1][0] >= time:
            self.rests.pop()

    def add_rest(self, time: float, record: RestRecord) -> None:
        """Add a record of a rest, after the place at the same time."""
        (before, *there), (now, *here) = self.places[-2:] if len(self.places) > 1 else ((-math.inf, 0.0, 0.0),) * 2
        # A world that was started again during a HALT counts rests anew.
        # So does one in which a physical robot was not measured for a while.
        seen = now - before <= MAX_POSE_INTERVAL and not self.physical
        stayed = seen or math.dist(there, here) < (MEASURED_PLACE if self.physical else SAME_PLACE)
        self.rests.append((time, record, before > -math.inf and stayed))

    def motion(self, name: str) -> Trajectory:
        speeds = dict(self.twists)
        times = [time for time, _, _ in self.places]
        twists = [speeds.get(time, STILL) for time in times]
        # A recording of an older release does not tell since when; then the samples alone must do.
        rests = self._spells() if self.rests else rests_of(times, list(map(at_rest, twists)))
        return Trajectory(
            name, self.physical, times, [p[1] for p in self.places], [p[2] for p in self.places],
            [twist.speed for twist in twists], rests,
        )  # fmt: skip

    def _spells(self) -> list[Rest]:
        spells: list[Rest] = []
        begun: RestRecord | None = None
        for _, record, seen in self.rests:
            if begun is not None:
                if record.at_rest and (seen or record.since <= begun.since):
                    # It has moved for less than the time between two records, or a world that began anew counts anew.
                    continue
                spells.append(Rest(begun.since, max(begun.since, record.since - record.resolution), begun.resolution))
            begun = record if record.at_rest else None
        return spells if begun is None else [*spells, Rest(begun.since, resolution=begun.resolution)]


def read_motions(path: Path | Sequence[Path]) -> dict[str, Trajectory]:
    """Read how each robot moved and stood, by name. Argument and errors are those of `read_tracks`."""
    found: dict[str, _Moves] = {}
    for topic, metadata, stamp, data in records_in(path):
        match topic.split("/"):
            case ["", "robot", name, "pose"]:
                moves = found.setdefault(name, _Moves(metadata.get("physical") == "true"))
                moves.step_back(stamp)
                position = decode(data, PoseInFrame, topic).pose.position
                moves.places.append((stamp, position.x, position.y))
            case ["", "robot", name, "twist"] if name in found:
                found[name].twists.append((stamp, decode(data, TwistRecord, topic).twist))
            case ["", "robot", name, "rest"] if name in found:
                found[name].add_rest(stamp, decode(data, RestRecord, topic))
    return {name: moves.motion(name) for name, moves in found.items()}


def read_estops(path: Path | Sequence[Path]) -> list[tuple[float, EstopRecord]]:
    """Read the orders that engaged and released the emergency stop, with the match time of each, s.

    Argument and errors are those of `read_tracks`.
    """
    topic = "/estop"
    return [(stamp, decode(data, EstopRecord, topic)) for at, _, stamp, data in records_in(path) if at == topic]


def _track(name: str, samples: _Samples) -> RobotPoses:
    poses = np.array(samples.poses, dtype=np.float64).reshape(-1, 4)
    return RobotPoses(
        name=name,
        physical=samples.physical,
        times=poses[:, 0],
        x=poses[:, 1],
        y=poses[:, 2],
        theta=poses[:, 3],
        roles=[role for role, _, _, _ in samples.referee],
        states=[state for _, state, _, _ in samples.referee],
        rounds=np.array([number for _, _, number, _ in samples.referee], dtype=np.int64),
        playing=np.array([playing for _, _, _, playing in samples.referee], dtype=np.bool_),
    )


def _robot_of_pose(topic: str) -> str | None:
    """The robot whose pose this topic is, or None for another topic."""
    match topic.split("/"):
        case ["", "robot", name, "pose"]:
            return name
        case _:
            return None
