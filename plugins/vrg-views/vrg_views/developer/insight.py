"""What is known at one instant to those who look into everything, and the streams that it comes from."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeVar

from vrg.bus.access import lines
from vrg.bus.codec import Received
from vrg.bus.messages import Links, Manual, MeasuredPose, Message, RefereeState, Report, RobotState, Sighting
from vrg.bus.topics import Keys, Topic, name_in
from vrg.hal.models import RobotModel
from vrg.hal.sensors.depiction import Cones, Depiction, Rays, Ticks
from vrg.seats.seat import SeatKind
from vrg.types import Pose
from vrg.ui.processes import Row, rows
from vrg.ui.scene import Scene
from vrg_views.developer.traffic import Stream, Traffic

T = TypeVar("T", bound=Message)

SEEN: Final = 1.5
"""The match time in s for which a sighting is shown."""
STALE: Final = 0.5
"""The match time in s after which a scan, or where a robot was measured, is not shown any more."""
REMEMBERED: Final = 1.0
"""The match time in s for which is known where robots were."""


@dataclass(frozen=True)
class Seen:
    """A sighting, and by whom."""

    player: str
    sighting: Sighting


@dataclass(frozen=True)
class Reading:
    """A measurement of a sensor.

    Args:
        name: whose. robot: its model. pose: where the robot truly was then.
    """

    name: str
    robot: RobotModel
    pose: Pose
    depiction: Depiction


@dataclass(frozen=True)
class Insight:
    """Everything that is known at one instant. Values by player are missing if they were never heard.

    Args:
        now: the match time, s. scene: the field and the match. state: the referee's whole state.
        selected: the player that is looked at; empty for none. official: whether the page has an official's seat.
        reports, manuals, robots, links: the newest messages of the players and their robots.
        measured: where physical robots were measured to be.
        sightings: those of the last SEEN seconds. readings: what sensors have measured that is drawn on the field:
            of lasers only those of the selected player. words: the newest reading of each sensor of the selected
            player, in words, by its key.
        streams: everything that is heard. processes: everything that runs.
    """

    now: float = 0.0
    scene: Scene = field(default_factory=Scene)
    selected: str = ""
    official: bool = True
    state: RefereeState | None = None
    reports: Mapping[str, Received[Report]] = field(default_factory=dict)
    manuals: Mapping[str, Received[Manual]] = field(default_factory=dict)
    robots: Mapping[str, Received[RobotState]] = field(default_factory=dict)
    links: Mapping[str, Received[Links]] = field(default_factory=dict)
    measured: Mapping[str, Received[MeasuredPose]] = field(default_factory=dict)
    sightings: Sequence[Seen] = ()
    readings: Sequence[Reading] = ()
    words: Mapping[str, str] = field(default_factory=dict)
    streams: Sequence[Stream] = ()
    processes: Sequence[Row] = ()

    @property
    def unheard(self) -> list[str]:
        """The keys that the seat of the page may not hear; an official's may hear all."""
        if self.official:
            return []
        return [line.path for line in lines() if all(party.kind is not SeatKind.WINDOW for party in line.listeners)]

    def pose(self, name: str) -> Pose | None:
        """Return the true pose of a robot, or None."""
        return next((body.pose for body in self.scene.bodies if body.name == name), None)


class Hearing:
    """Takes in what is heard. It decodes the newest message of a key, and only while somebody looks.

    Args:
        keys: of the match. traffic: counts all messages. robots: the models of the players' robots, by name.
        official: whether the page has an official's seat; another one does not hear everything.
    """

    def __init__(self, keys: Keys, traffic: Traffic, robots: Mapping[str, RobotModel], *, official: bool) -> None:
        self._keys, self._traffic, self._robots, self._official = keys, traffic, robots, official
        self._seen: dict[Seen, None] = {}
        self._places: deque[tuple[float, dict[str, Pose]]] = deque()

    def close(self) -> None:
        """Hear nothing any more. Idempotent."""
        self._traffic.close()
        self._seen.clear()
        self._places.clear()

    def take(self, now: float) -> None:
        """Take in what has arrived by match time `now`, s, since this was first called or `close` was."""
        self._traffic.open()
        self._traffic.take()
        for poses in self._traffic.newest(self._keys.poses):
            if self._places and poses.stamp < self._places[-1][0]:
                self._places.clear()
            self._places.append((poses.stamp, {body.name: body.pose for body in poses.body.bodies}))
        while self._places and now - self._places[0][0] > REMEMBERED:
            self._places.popleft()
        for name, said in self._by_name(self._keys.sightings()).items():
            self._seen |= {Seen(name, sighting): None for sighting in said.body.seen}
        self._seen = {seen: None for seen in self._seen if -SEEN <= now - seen.sighting.time <= SEEN}

    def insight(self, now: float, scene: Scene, selected: str) -> Insight:
        """Return the present knowledge.

        Args:
            scene: what is seen now. selected: the player that is looked at; empty for none.
        """
        keys, newest = self._keys, self._traffic.newest
        measured = self._by_name(keys.robot_pose())
        processes = newest(keys.processes)
        pulses = {pulse.key.removeprefix(f"{keys.root}/pulse/"): pulse.body for pulse in newest(keys.pulse())}
        return Insight(
            now=now,
            scene=scene,
            selected=selected,
            official=self._official,
            state=next((state.body for state in newest(keys.referee_state)), None),
            reports=self._by_name(keys.report()),
            manuals=self._by_name(keys.manual()),
            robots=self._by_name(keys.robot_state()),
            links=self._by_name(keys.links()),
            measured={name: pose for name, pose in measured.items() if abs(now - pose.stamp) <= STALE},
            sightings=tuple(self._seen),
            readings=tuple(self._readings(now, selected)),
            words=self._words(selected),
            streams=self._traffic.look(),
            processes=rows(processes[0].body.processes, pulses) if processes else (),
        )

    def _readings(self, now: float, selected: str) -> Iterator[Reading]:
        for name, robot in self._robots.items():
            for spec in robot.sensors:
                drawn = spec.depiction in (Cones, Ticks) or (spec.depiction is Rays and name == selected)
                topic = self._keys.sensor(spec.message, name, spec.name)
                for reading in self._traffic.newest(topic) if drawn else ():
                    pose, depiction = self._pose_at(name, reading.stamp), spec.depict(reading.body)
                    if pose is not None and depiction is not None and abs(now - reading.stamp) <= STALE:
                        yield Reading(name, robot, pose, depiction)

    def _words(self, selected: str) -> dict[str, str]:
        robot = self._robots.get(selected)
        return {
            reading.key.removeprefix(f"{self._keys.root}/"): reading.body.words
            for spec in (robot.sensors if robot is not None else ())
            for reading in self._traffic.newest(self._keys.sensor(spec.message, selected, spec.name))
        }

    def _pose_at(self, name: str, time: float) -> Pose | None:
        """The pose of a robot at a match time, s, or as near to it as is known."""
        known = [(abs(stamp - time), poses[name]) for stamp, poses in self._places if name in poses]
        return min(known, key=lambda found: found[0])[1] if known else None

    def _by_name(self, topic: Topic[T]) -> dict[str, Received[T]]:
        """The newest message of each robot or player."""
        return {name_in(message.key): message for message in self._traffic.newest(topic)}
