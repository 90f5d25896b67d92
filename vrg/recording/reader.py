"""Reads a recording back: where each robot was, and what the referee called.

A file that is torn, because its recorder was killed or its disk was full, is read as far as it goes.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt
from mcap.exceptions import EndOfFile, InvalidMagic, McapError
from mcap.reader import NonSeekingReader
from zstandard import ZstdError

from vrg.bus.messages import Sighting, Stage, Stroke, Zone
from vrg.errors import MessageError
from vrg.recording.foxglove import PoseInFrame, SceneUpdate, heading_of
from vrg.recording.records import CallRecord, SightingsRecord, StateRecord
from vrg.recording.schemas import schema_name
from vrg.recording.sketches import strokes_of

R = TypeVar("R", bound=msgspec.Struct)

_TORN: Final = (EndOfFile, struct.error, ZstdError)
"""What mcap's reader raises where a file ends within a record."""


@dataclass(frozen=True)
class Track:
    """Where one robot was.

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
    """What was played and where.

    Args:
        game: its name, empty where the referee never spoke.
        zones: of each round that was begun, by its number, as they were while it was played.
    """

    game: str
    zones: dict[int, list[Zone]]


_Referee = tuple[str, str, int, bool]
"""What the referee last said of a player: its role, its state, the round, and whether that is being played."""


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


def read_tracks(path: Path | Sequence[Path]) -> dict[str, Track]:
    """Read each robot's track, by name.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.

    Raises:
        OSError: the file cannot be read.
        MessageError: it is not a recording of this program.
    """
    samples: dict[str, _Samples] = {}
    roles: dict[str, tuple[str, str]] = {}
    match = (0, False)
    for topic, metadata, stamp, data in _records(path):
        if topic == "/referee/state":
            state = _decode(data, StateRecord, topic)
            roles = {p.name: (p.role, p.state) for p in state.players}
            match = (state.round, state.stage == Stage.PLAY_ROUND)
        elif (name := _robot_of_pose(topic)) is not None:
            if name not in samples:
                samples[name] = _Samples(metadata.get("physical") == "true")
            samples[name].add(stamp, _decode(data, PoseInFrame, topic), (*roles.get(name, ("", "")), *match))
    return {name: _track(name, of) for name, of in samples.items()}


def read_calls(path: Path | Sequence[Path]) -> list[CallRecord]:
    """Read the referee's calls in the order of their numbers. Argument and errors are those of `read_tracks`."""
    topic = "/referee/event"
    calls = [_decode(data, CallRecord, topic) for at, _, _, data in _records(path) if at == topic]
    return sorted(calls, key=lambda call: call.number)


def read_setting(path: Path | Sequence[Path]) -> Setting:
    """Read the game and its field. Argument and errors are those of `read_tracks`."""
    game = ""
    zones: dict[int, list[Zone]] = {}
    for topic, _, _, data in _records(path):
        if topic == "/referee/state":
            state = _decode(data, StateRecord, topic)
            game = state.game
            if state.stage == Stage.PLAY_ROUND or state.round not in zones:
                zones[state.round] = state.zones
    return Setting(game, zones)


@dataclass(frozen=True)
class Thought:
    """What a player has sketched.

    Args:
        player: its name. time: match time, s. strokes: the dots and lines.
    """

    player: str
    time: float
    strokes: list[Stroke]


def read_sightings(path: Path | Sequence[Path]) -> dict[str, list[Sighting]]:
    """Read what each player has told the referee it has seen. Argument and errors are those of `read_tracks`."""
    found: dict[str, list[Sighting]] = {}
    for topic, _, _, data in _records(path):
        match topic.split("/"):
            case ["", "player", name, "sightings"]:
                found.setdefault(name, []).extend(_decode(data, SightingsRecord, topic).seen)
    return found


def read_sketches(path: Path | Sequence[Path]) -> list[Thought]:
    """Read what players have sketched, in the order of time. Argument and errors are those of `read_tracks`."""
    found = []
    for topic, _, stamp, data in _records(path):
        match topic.split("/"):
            case ["", "player", name, "sketch"]:
                entities = _decode(data, SceneUpdate, topic).entities
                found.append(Thought(name, stamp, [s for entity in entities for s in strokes_of(entity)]))
    return sorted(found, key=lambda thought: thought.time)


def _track(name: str, samples: _Samples) -> Track:
    poses = np.array(samples.poses, dtype=np.float64).reshape(-1, 4)
    return Track(
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


def _records(path: Path | Sequence[Path]) -> Iterator[tuple[str, dict[str, str], float, bytes]]:
    """(topic, channel's metadata, match time in s, JSON) in the order of each file, up to where it is torn."""
    if not isinstance(path, Path):
        for part in path:
            yield from _records(part)
        return
    with path.open("rb") as stream:
        try:
            for _, channel, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
                yield channel.topic, channel.metadata, message.log_time / 1e9, message.data
        except _TORN:
            return
        except (InvalidMagic, McapError) as error:
            raise MessageError(f"{path}: expected an MCAP recording: {error}") from None


def _decode(data: bytes, record: type[R], topic: str) -> R:
    try:
        return msgspec.json.decode(data, type=record)
    except msgspec.DecodeError as error:
        raise MessageError(f"{topic}: expected {schema_name(record)}: {error}") from None
