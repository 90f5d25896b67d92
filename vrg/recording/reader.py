"""What a recording tells: where each robot was and how it moved, what the referee called, what players thought.

Each is a function of the messages, which are read in one pass; see `vrg.recording.recorded`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from msgspec import structs

from vrg.bus.messages import Body, Call, Clock, FieldObject, RefereeState, Sighting, Stage, Stroke, Zone, at_rest
from vrg.recording.recorded import RecordedMatch, newest, read_recorded
from vrg.recording.stops import MAX_POSE_INTERVAL, Rest, Trajectory, rests_of
from vrg.types import LEVEL, Twist


@dataclass(frozen=True)
class RobotPoses:
    """The recorded poses of one robot.

    Args:
        physical: a real robot, not a virtual one.
        times: match time, s, rising. x, y: m. theta: rad, -pi to pi. All of shape (n,).
        roles, states: the referee's words at each time; empty before it spoke.
        rounds: the round at each time, 0 before the first; shape (n,).
        playing: whether a round was being played, and not prepared, halted or over; shape (n,).
        z: the height above the ground, m; of shape (0,) if it never left that.
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
    z: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class Setting:
    """The match of a recording, and its place.

    Args:
        game: its name, empty where the referee never spoke.
        zones: of each round that was begun, by its number, as they were while it was played.
        objects: the things of the game that are no robots, as the referee last published them.
        bodies: those that move, each time that it published them while a round was played: the round, s, and the body.
    """

    game: str
    zones: dict[int, tuple[Zone, ...]]
    objects: Sequence[FieldObject] = ()
    bodies: Sequence[tuple[int, float, FieldObject]] = ()


_Seen = tuple[float, Body, RefereeState | None]
"""Where a robot was at a match time, s, and what the referee had said by then."""


def read_tracks(path: Path | Sequence[Path], torn: list[Path] | None = None) -> dict[str, RobotPoses]:
    """Read each robot's track, by name.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.
        torn: where to note the files that end in the middle.

    Raises:
        OSError: the file cannot be read.
        MessageError: it is not a recording of this release.
    """
    recorded = read_recorded(path)
    if torn is not None:
        torn += recorded.torn
    return tracks_of(recorded)


def tracks_of(recorded: RecordedMatch) -> dict[str, RobotPoses]:
    """Each robot's track, by name."""
    found: dict[str, list[_Seen]] = {}
    for stamp, poses in recorded.poses:
        state = newest(recorded.states, stamp)
        for body in poses.bodies:
            found.setdefault(body.name, []).append((stamp, body, state))
    return {name: _track(name, seen) for name, seen in found.items()}


class RecordedCall(Call, frozen=True, kw_only=True):
    """A call of the referee, with the match time at which it was made, s, and the round that was being played."""

    time: float
    round: int


def calls_of(recorded: RecordedMatch) -> list[RecordedCall]:
    """The referee's calls in the order of their numbers."""
    found = []
    for stamp, call in recorded.calls:
        state = newest(recorded.states, stamp)
        found.append(RecordedCall(**structs.asdict(call), time=stamp, round=0 if state is None else state.round))
    return sorted(found, key=lambda call: call.number)


def setting_of(recorded: RecordedMatch) -> Setting:
    """The game and its field."""
    zones: dict[int, tuple[Zone, ...]] = {}
    for _, state in recorded.states:
        if state.stage == Stage.PLAY_ROUND or state.round not in zones:
            zones[state.round] = state.zones
    last = recorded.states[-1][1] if recorded.states else None
    played = [(stamp, state) for stamp, state in recorded.states if state.stage == Stage.PLAY_ROUND]
    bodies = tuple((s.round, stamp, o) for stamp, s in played for o in s.objects if o.is_body)
    return Setting("" if last is None else last.game, zones, () if last is None else last.objects, bodies)


@dataclass(frozen=True)
class Thought:
    """A sketch of a player.

    Args:
        player: its name. time: match time, s. strokes: the dots and lines.
    """

    player: str
    time: float
    strokes: Sequence[Stroke]


def sightings_of(recorded: RecordedMatch) -> dict[str, list[Sighting]]:
    """The sightings that each player has reported."""
    return {name: [s for _, report in of for s in report.seen] for name, of in recorded.sightings.items()}


def thoughts_of(recorded: RecordedMatch) -> list[Thought]:
    """What players have sketched, in the order of time."""
    found = [Thought(name, stamp, s.strokes) for name, of in recorded.sketches.items() for stamp, s in of]
    return sorted(found, key=lambda thought: thought.time)


SAME_PLACE = 1e-6
"""The distance in m below which two places are the same: no robot comes back to where it was so exactly."""
MEASURED_PLACE = 0.03
"""The distance in m below which two places of a physical robot are the same, as far as fixes tell."""


class _Start(NamedTuple):
    """The beginning of a rest, or of a motion.

    Args:
        since: the match time of the tick of the world at which it began, s. at_rest: whether it is a rest.
        resolution: how long before that it was last known to move, or to be at rest somewhere else, s.
        stayed: whether the robot was seen shortly before, or before at the same place.
    """

    since: float
    at_rest: bool
    resolution: float
    stayed: bool


@dataclass
class _Moves:
    """The motion of one robot in a recording: places, speeds, and the times at which it came to rest or moved."""

    physical: bool
    places: list[tuple[float, float, float]] = field(default_factory=list)
    twists: list[Twist] = field(default_factory=list)
    starts: list[_Start] = field(default_factory=list)
    flew: bool = False
    _rest: float | None = None
    _known: tuple[float, int] | None = None
    """When it was last known to move, or to be at rest as was seen then: match time in s, and the epoch."""

    def add(self, stamp: float, body: Body, clock: Clock | None) -> None:
        """Add where it was at a match time, s. Not all poses are recorded, but each tells since when it is at rest.

        Args:
            clock: the last one before.
        """
        self.places.append((stamp, body.pose.x, body.pose.y))
        self.twists.append(body.twist)
        self.flew |= body.pose.z > 0.0
        measured, moves, epoch = stamp - body.age, not at_rest(body.twist), 0 if clock is None else clock.epoch
        same = bool(self.starts) and self._rest == body.rest
        if moves or same:
            self._known = measured, epoch
        # The next place of a physical robot that is no longer measured shows whether it has moved.
        if same or (body.physical and body.rest is None and not moves):
            return
        self._rest = body.rest
        since = measured if body.rest is None else body.rest
        resolution = clock.time / clock.tick if clock is not None and clock.tick else 0.0
        known, its_epoch = self._known or (since, epoch)
        # A physical robot is measured less often than the world ticks. A world that continues from a snapshot knows
        # nothing of the time before, of which perhaps nothing was heard.
        if body.physical or its_epoch != epoch:
            resolution = max(resolution, since - known)
        self.starts.append(_Start(since, body.rest is not None, round(resolution, 6), self._stayed()))

    def _stayed(self) -> bool:
        if len(self.places) < 2:
            return False
        (before, *there), (now, *here) = self.places[-2:]
        # A world that was started again during a HALT counts rests again.
        # So does one in which a physical robot was not measured for a while.
        seen = now - before <= MAX_POSE_INTERVAL and not self.physical
        return seen or math.dist(there, here) < (MEASURED_PLACE if self.physical else SAME_PLACE)

    def motion(self, name: str) -> Trajectory:
        times = [time for time, _, _ in self.places]
        # For a physical robot that was never measured, only the samples show when it was at rest.
        # What flies stands where it hovers, and also while it then lands: climbing is no motion here.
        stands = (at_rest(structs.replace(twist, climb=LEVEL)) for twist in self.twists)
        rests = self._spells() if self.starts and not self.flew else rests_of(times, stands)
        return Trajectory(
            name, self.physical, times, [p[1] for p in self.places], [p[2] for p in self.places],
            [twist.speed for twist in self.twists], rests,
        )  # fmt: skip

    def _spells(self) -> list[Rest]:
        spells: list[Rest] = []
        begun: _Start | None = None
        for start in self.starts:
            if begun is not None:
                if start.at_rest and (start.stayed or start.since <= begun.since):
                    # It has moved for less than the time between two records, or a world that began again counts again.
                    continue
                spells.append(Rest(begun.since, max(begun.since, start.since - start.resolution), begun.resolution))
            begun = start if start.at_rest else None
        return spells if begun is None else [*spells, Rest(begun.since, resolution=begun.resolution)]


def motions_of(recorded: RecordedMatch) -> dict[str, Trajectory]:
    """How each robot moved and stood, by name."""
    found: dict[str, _Moves] = {}
    for stamp, poses in recorded.poses:
        clock = newest(recorded.clocks, stamp)
        for body in poses.bodies:
            found.setdefault(body.name, _Moves(body.physical)).add(stamp, body, clock)
    return {name: moves.motion(name) for name, moves in found.items()}


def _plays(state: RefereeState) -> bool:
    return state.stage == Stage.PLAY_ROUND and state.halted is None


def _track(name: str, seen: Sequence[_Seen]) -> RobotPoses:
    said = [state for _, _, state in seen]
    own = [None if state is None else state.player(name) for state in said]
    return RobotPoses(
        name=name,
        physical=seen[0][1].physical,
        times=np.array([stamp for stamp, _, _ in seen]),
        x=np.array([body.pose.x for _, body, _ in seen]),
        y=np.array([body.pose.y for _, body, _ in seen]),
        theta=np.array([math.remainder(body.pose.theta, math.tau) for _, body, _ in seen]),
        roles=["" if player is None else player.role for player in own],
        states=["" if player is None else player.state for player in own],
        rounds=np.array([0 if state is None else state.round for state in said], dtype=np.int64),
        playing=np.array([state is not None and _plays(state) for state in said], dtype=np.bool_),
        z=np.array([body.pose.z for _, body, _ in seen] if any(body.pose.z for _, body, _ in seen) else []),
    )
