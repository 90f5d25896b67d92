"""What a student writes: a strategy, the brain of one player."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from vrg.agents.control import Twist
from vrg.bus.messages import PlayerStatus, Pose, RefereeState, Zone
from vrg.geometry import Rectangle, Vector
from vrg.hal.models import RobotModel
from vrg.hal.robot import Readings


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
    """

    time: float
    me: PlayerStatus
    readings: Readings
    referee: RefereeState
    velocities: Mapping[str, Vector]
    robot: RobotModel

    @property
    def pose(self) -> Pose:
        """This player's own pose, by its INS."""
        return self.readings.ins

    @property
    def position(self) -> Vector:
        """This player's own place."""
        return self.readings.ins.x, self.readings.ins.y

    def others(self) -> list[PlayerStatus]:
        """Every other player whose pose is known."""
        return [p for p in self.referee.players if p.name != self.me.name and p.pose is not None]

    def zone(self, kind: str) -> Rectangle | None:
        """The first zone of a kind, such as `field` or `safe`."""
        zone: Zone | None = next((z for z in self.referee.zones if z.kind == kind), None)
        return None if zone is None else Rectangle(zone.x_min, zone.y_min, zone.x_max, zone.y_max)


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
    def act(self, view: View) -> Twist:
        """The twist to drive with until the next tick.

        Called at each tick while the match is not halted and the robot has no fault; while the player may not move the
        result is ignored.
        """
