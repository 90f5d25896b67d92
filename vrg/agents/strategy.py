"""What a student writes: a strategy, the brain of one player."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vrg.bus.messages import PlayerStatus, RefereeState
from vrg.bus.radio import Heard
from vrg.hal.models import RobotModel
from vrg.hal.readings import Readings
from vrg.regions import Region
from vrg.types import STILL, Pose, Twist, Vector


@dataclass(frozen=True)
class Action:
    """What a player does at one tick.

    Args:
        twist: the motion to drive with until the next tick.
        say: what it says to its team: numbers, texts, lists and tables of these; None says nothing.
    """

    twist: Twist = STILL
    say: Any = None


@dataclass(frozen=True)
class View:
    """What a player knows at one tick.

    Args:
        time: match time, s.
        me: what the referee says of this player.
        readings: of its own robot's sensors.
        referee: the state that everybody is told.
        velocities: of every player whose pose is published, m/s, estimated from those poses.
        robot: its own robot's description.
        heard: what others of its team have said since the last tick.
        pose: where this player is, by its robot's own measurement.
    """

    time: float
    me: PlayerStatus
    readings: Readings
    referee: RefereeState
    velocities: Mapping[str, Vector]
    robot: RobotModel
    pose: Pose
    heard: Sequence[Heard] = ()

    @property
    def position(self) -> Vector:
        """This player's own place."""
        return self.pose.x, self.pose.y

    @property
    def speed(self) -> float | None:
        """This player's own speed ahead by its wheels, m/s; None where its robot does not measure it."""
        odometry = self.readings.odometry
        return None if odometry is None else odometry.value.twist.v

    def others(self) -> list[PlayerStatus]:
        """Every other player whose pose is known."""
        return [p for p in self.referee.players if p.name != self.me.name and p.pose is not None]

    def zone(self, kind: str) -> Region | None:
        """The region of the first zone of a kind, such as `field` or `safe`."""
        return next((zone.region for zone in self.referee.zones if zone.kind == kind), None)


class Strategy(ABC):
    """Decides how one player moves. A subclass and one line in a match file make a player of one's own.

    Args:
        name: the player's.
        robot: its robot's description.
    """

    def __init__(self, name: str, robot: RobotModel) -> None:
        self.name = name
        self.robot = robot

    @property
    def mode(self) -> str:
        """What it does now, in a word or two, for those who watch."""
        return "-"

    @abstractmethod
    def act(self, view: View) -> Twist | Action:
        """The twist to drive with until the next tick, or an action with what the player says to its team.

        It is called at each tick while the match is not halted and the robot has no fault. While the player may not
        move, the twist is ignored. Numbers may be Python's or numpy's.
        """


def action_of(answer: object) -> Action:
    """What a strategy has answered, with Python's own numbers.

    A number that is none, such as NaN, passes: the robot's device refuses it, and says so as a fault of the player.

    Raises:
        TypeError: it is neither a twist nor an action.
    """
    action = answer if isinstance(answer, Action) else Action(answer)  # type: ignore[arg-type]
    twist = action.twist
    if not isinstance(twist, Twist):
        raise TypeError(f"expected a Twist(v, w) or an Action, got {answer!r}")
    try:
        plain = Twist(float(twist.v), float(twist.w))
    except (TypeError, ValueError):
        raise TypeError(f"expected a Twist of two numbers, got {twist!r}") from None
    return Action(plain, action.say)
