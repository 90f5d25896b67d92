"""The knowledge of the developers' view at one instant, and the subscriptions that it comes from."""

from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeVar

from vrg.bus.access import lines
from vrg.bus.codec import Received
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import Call, Links, Manual, MeasuredPose, Message, RefereeState, Report, RobotState, Sighting
from vrg.bus.seats import SeatKind
from vrg.bus.topics import Keys, name_in
from vrg.bus.traffic import Stream, Traffic
from vrg.hal.models import RobotModel
from vrg.hal.sensors.depiction import Depiction
from vrg.types import Pose
from vrg.ui.processes import Board, Row
from vrg.ui.scene import Scene

T = TypeVar("T", bound=Message)
Robots = Mapping[str, RobotModel]

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
        robot: whose. pose: where the robot truly was then.
    """

    robot: str
    pose: Pose
    depiction: Depiction


@dataclass(frozen=True)
class Insight:
    """Everything that is known at one instant. What is by player is missing where it was never heard.

    Args:
        now: the match time, s. scene: the field and the match. state: the referee's whole state.
        official: whether this window has an official's seat. unheard: the keys that its seat may not hear.
        reports, manuals, robots, links: the newest messages of the players and their robots.
        measured: where physical robots were measured to be.
        sightings: those of the last SEEN seconds. readings: what the sensors that are shown on the field have
            measured. words: the newest reading of each sensor of the selected player, in words, by its key.
        streams: everything that is heard. processes: everything that runs.
        refusal: what the referee has refused lately, in words; empty if nothing.
    """

    now: float = 0.0
    scene: Scene = field(default_factory=Scene)
    state: RefereeState | None = None
    official: bool = True
    unheard: tuple[str, ...] = ()
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
    refusal: str = ""

    def pose(self, name: str) -> Pose | None:
        """Return the true pose of a robot, or None."""
        return next((body.pose for body in self.scene.bodies if body.name == name), None)


def unheard_by(kind: SeatKind) -> tuple[str, ...]:
    """The keys that a seat of this kind may not hear; an official may hear all."""
    if kind is SeatKind.OFFICIAL:
        return ()
    return tuple(line.path for line in lines() if kind not in {party.kind for party in line.listeners})


class Hearing:
    """Takes in what is heard.

    Args:
        mailbox: the window's own. keys: of the match. traffic: counts all messages; sensors are decoded from it while
            they are shown. robots: the models of the players' robots, by name.
        official: whether this window has an official's seat.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys, traffic: Traffic, robots: Robots, *, official: bool) -> None:
        sensors = [(name, spec) for name, robot in robots.items() for spec in robot.sensors]
        self._sensors = [(name, spec, keys.sensor(spec.message, name, spec.name)) for name, spec in sensors]
        self._root = f"{keys.root}/"
        self._traffic = traffic
        self._poses = mailbox.subscribe(keys.poses)
        self._state = mailbox.subscribe(keys.referee_state)
        self._reports = mailbox.subscribe(keys.report())
        self._robots = mailbox.subscribe(keys.robot_state())
        self._sightings = mailbox.subscribe(keys.sightings())
        self._manuals = mailbox.subscribe(keys.manual()) if official else None
        self._links = mailbox.subscribe(keys.links()) if official else None
        self._measured = mailbox.subscribe(keys.robot_pose()) if official else None
        self._board = Board(mailbox, keys)
        self._official = official
        self._unheard = unheard_by(SeatKind.OFFICIAL if official else SeatKind.WINDOW)
        self._seen: deque[Seen] = deque()
        self._places: deque[tuple[float, dict[str, Pose]]] = deque()
        self._refusal = ""

    def take(self, now: float, calls: Sequence[Call]) -> None:
        """Take in what has arrived by match time `now`, s; `calls` are the referee's new ones."""
        self._traffic.take()
        for call in calls:
            if call.rule == "refused":
                self._refusal = call.text
        for poses in self._poses.take():
            if self._places and poses.stamp < self._places[-1][0]:
                self._places.clear()
            self._places.append((poses.stamp, {body.name: body.pose for body in poses.body.bodies}))
        while self._places and now - self._places[0][0] > REMEMBERED:
            self._places.popleft()
        for seen in self._sightings.take():
            player = name_in(seen.key)
            self._seen += [Seen(player, sighting) for sighting in seen.body.seen]
        self._seen = deque(s for s in self._seen if -SEEN <= now - s.sighting.time <= SEEN)

    def insight(
        self, now: float, scene: Scene, *, drawn: Collection[type[Depiction]] = (), selected: str | None = None
    ) -> Insight:
        """Return the present knowledge.

        Args:
            scene: what is seen now. drawn: the types of depictions that the field shows. selected: the player of whose
                sensors the readings are wanted in words, or None.
        """
        state = self._state.latest
        return Insight(
            now=now,
            scene=scene,
            state=None if state is None else state.body,
            official=self._official,
            unheard=self._unheard,
            reports=_by_name(self._reports),
            manuals=_by_name(self._manuals),
            robots=_by_name(self._robots),
            links=_by_name(self._links),
            measured={name: m for name, m in _by_name(self._measured).items() if abs(now - m.stamp) <= STALE},
            sightings=tuple(self._seen),
            readings=tuple(self._readings(now, drawn)),
            words=self._words(selected),
            streams=self._traffic.look(),
            processes=self._board.look(),
            refusal=self._refusal,
        )

    def forget_refusal(self) -> None:
        """Do not show any more what the referee has refused."""
        self._refusal = ""

    def _readings(self, now: float, drawn: Collection[type[Depiction]]) -> Iterator[Reading]:
        for robot, spec, topic in self._sensors:
            for reading in self._traffic.newest(topic) if spec.depiction in drawn else ():
                pose, depiction = self._pose_at(robot, reading.stamp), spec.depict(reading.body)
                if pose is not None and depiction is not None and abs(now - reading.stamp) <= STALE:
                    yield Reading(robot, pose, depiction)

    def _words(self, selected: str | None) -> dict[str, str]:
        return {
            topic.key.removeprefix(self._root): reading.body.words
            for robot, _, topic in self._sensors
            if robot == selected
            for reading in self._traffic.newest(topic)
        }

    def _pose_at(self, name: str, time: float) -> Pose | None:
        """The pose of a robot at a match time, s, or as near to it as is known."""
        known = [(abs(stamp - time), poses[name]) for stamp, poses in self._places if name in poses]
        return min(known, key=lambda found: found[0])[1] if known else None


def _by_name(inlet: Inlet[T] | None) -> dict[str, Received[T]]:
    """The newest message of each robot or player; none without a subscription."""
    return {} if inlet is None else {name_in(key): message for key, message in inlet.by_key.items()}
