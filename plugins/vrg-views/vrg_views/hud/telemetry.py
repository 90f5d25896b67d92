"""One player's knowledge of itself and of the match: exactly what its own process may hear, never the true poses."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

from msgspec import structs

from vrg.bus.codec import Received
from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import Message, PlayerStatus, RefereeState, Report, SensorMessage
from vrg.bus.node import Tick, is_fresh
from vrg.bus.topics import Keys
from vrg.hal.models import RobotModel
from vrg.hal.sensors.depiction import Depiction
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.spec import SensorSpec
from vrg.types import Pose

S = TypeVar("S", bound=SensorMessage)

SIGHT_TIMEOUT: Final = 0.25
"""The match time in s by which the poses that a team sees may be older than the state of the referee."""


@dataclass(frozen=True)
class Sensed:
    """A sensor of the robot, and its newest reading; None before the first."""

    spec: SensorSpec
    reading: Received[SensorMessage] | None = None

    @property
    def depiction(self) -> Depiction | None:
        """The reading as it can be drawn; None where there is none."""
        return None if self.reading is None else self.spec.depict(self.reading.body)


@dataclass(frozen=True)
class Telemetry:
    """A player's knowledge at one instant. What never came is None.

    Args:
        now: the match time, s. live: the match clock runs.
        state: the referee's state, with the poses that the player's team may know. me: the player in it.
        report: of the player's process, with its match time.
        pose: where the robot is by its own measurement. pose_age: the match time since then, s.
        speed: the speed by the robot's wheels, m/s; below 0 where it drives straight back.
        sensors: the sensors of the robot, in the order of its model.
        player_age, robot_age, referee_age: the match time in s since the newest report of the player, the newest
            reading of any of its sensors, and the newest state of the referee were made.
    """

    now: float = 0.0
    live: bool = False
    state: RefereeState | None = None
    me: PlayerStatus | None = None
    report: Received[Report] | None = None
    pose: Pose | None = None
    pose_age: float | None = None
    speed: float | None = None
    sensors: tuple[Sensed, ...] = ()
    player_age: float | None = None
    robot_age: float | None = None
    referee_age: float | None = None

    def first(self, depiction: type[Depiction]) -> Sensed | None:
        """The first sensor whose readings are depicted so, or None where the robot has none."""
        return next((sensed for sensed in self.sensors if sensed.spec.depiction is depiction), None)

    def age(self, reading: Received[Message] | None) -> float | None:
        """The match time in s since a reading was made."""
        return None if reading is None else max(0.0, self.now - reading.stamp)


class Receiver:
    """A display's subscriptions to what its player may hear of itself and of the others.

    Args:
        mailbox: the display's own. keys: of the match.
        player, team: whose display it is. robot: the description of its robot.
    """

    def __init__(self, mailbox: Mailbox, keys: Keys, player: str, team: str, robot: RobotModel) -> None:
        self._player = player
        self._state = mailbox.subscribe(keys.referee_state)
        self._sight = mailbox.subscribe(keys.sight(team))
        self._report = mailbox.subscribe(keys.report(player))
        self._measured = mailbox.subscribe(keys.robot_pose(player))
        self._sensors = [(s, mailbox.subscribe(keys.sensor(s.message, player, s.name))) for s in robot.sensors]

    def look(self, tick: Tick) -> Telemetry:
        """Return the present knowledge."""
        now = tick.time
        state, report = self._state.latest, self._report.latest
        seen = None if state is None else self._seen(state)
        sensors = tuple(Sensed(spec, inlet.latest) for spec, inlet in self._sensors)
        ins, odometry, measured = _newest(sensors, Ins), _newest(sensors, Odometry), self._measured.latest
        pose, stamp = (None, None) if ins is None else (ins.body.pose, ins.stamp)
        if measured is not None and (stamp is None or measured.stamp > stamp):
            # The device of a physical robot tells the world where it is.
            pose, stamp = measured.body.pose, measured.stamp
        stamps = [sensed.reading.stamp for sensed in sensors if sensed.reading is not None]
        stamps += [] if stamp is None else [stamp]
        return Telemetry(
            now=now,
            live=tick.live,
            state=seen,
            me=None if seen is None else seen.player(self._player),
            report=report,
            pose=pose,
            pose_age=None if stamp is None else max(0.0, now - stamp),
            speed=None if odometry is None else odometry.body.twist.speed,
            sensors=sensors,
            player_age=None if report is None else max(0.0, now - report.stamp),
            robot_age=max(0.0, now - max(stamps)) if stamps else None,
            referee_age=None if state is None else max(0.0, now - state.stamp),
        )

    def _seen(self, state: Received[RefereeState]) -> RefereeState:
        """The referee's state with the poses that only this team may know. Those that are older do not count."""
        sight = self._sight.latest
        if sight is None or not is_fresh(sight.stamp, state.stamp, SIGHT_TIMEOUT):
            return state.body
        poses = sight.body.poses
        return structs.replace(
            state.body, players=tuple(structs.replace(p, pose=poses.get(p.name)) for p in state.body.players)
        )


def _newest(sensors: Sequence[Sensed], message: type[S]) -> Received[S] | None:
    """The newest reading of the first sensor with this message."""
    return next((s.reading for s in sensors if s.spec.message is message), None)  # type: ignore[return-value]
