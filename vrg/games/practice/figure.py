"""The strategy of a robot that drives a figure, by which its numbers can be found."""

import math
from dataclasses import dataclass

from vrg.agents.strategy import Strategy, View
from vrg.geometry import ahead, wrap
from vrg.hal.models import RobotModel
from vrg.portable.scalars import atan2
from vrg.regions import Rectangle, Region
from vrg.types import STILL, Pose, Twist

REST = 0.7
"""The time in s for which the robot stands after each part, so that it is seen how it stops."""
ASTRAY = 0.3
"""The distance in m from the start above which it drives back before it goes on."""
ARRIVED = 0.1
"""The distance in m, and the angle in rad, from where it is to be, at which it is there."""
SLOW = 0.4
"""The share of its top speed at which it drives back."""
ROOM = Rectangle(-1.0, -1.0, 1.0, 1.0)
"""The room in m around where it begins, if no field is given."""
REACTION = 0.2
"""The time in s from a look to when a command counts, besides the robot's own delay."""
WRONG_WAY = 0.5
"""The distance in m by which it may get farther away on its way back; then a direction is wrong, and it stands."""


@dataclass(frozen=True)
class Part:
    """A part of the figure.

    Args:
        ahead: the speed, as a share of the top speed. turning: the turn rate of the wheels at it, as such a share.
        way: it ends after this share of the room. turn: or after this turn, rad. seconds: or after this time, s.
    """

    ahead: float = 0.0
    turning: float = 0.0
    way: float = math.inf
    turn: float = math.inf
    seconds: float = 20.0


FIGURE = (
    Part(ahead=1.0, way=1.0),
    Part(ahead=-1.0, way=1.0),
    Part(turning=0.5, turn=2 * math.pi),
    Part(turning=-0.5, turn=2 * math.pi),
    *(Part(ahead=share, seconds=0.5) for share in (1.0, -1.0, 0.5, -0.5)),
    Part(ahead=0.5, turning=0.4, turn=2 * math.pi),
    Part(ahead=0.5, turning=-0.4, turn=2 * math.pi),
    *(Part(turning=share, seconds=0.5) for share in (0.6, -0.6)),
)
"""Straight ahead and back, on the spot and in circles to both sides, and jerks: all that tells the numbers apart."""


class Figure(Strategy):
    """Drives the figure again and again, within a field around where it begins.

    The field is that of the practice match. Half its smaller side is the way that it drives straight ahead, and its
    middle is where it drives back to. Its centre stays within the field, as far as it can stop there.
    """

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._room: Region | None = None
        self._home = Pose(0.0, 0.0, 0.0)
        self._part = 0
        self._begun: tuple[float, Pose] | None = None
        self._turned = 0.0
        self._heading = 0.0
        self._rest_until = 0.0
        self._returns = False
        self._nearest = math.inf
        """The least distance to the middle on its way back, m."""
        self._lost = False

    @property
    def mode(self) -> str:
        """The part of the figure that it drives."""
        if self._lost:
            return "Gives up"
        return "Returning" if self._returns else f"Part {self._part + 1} of {len(FIGURE)}"

    def act(self, view: View) -> Twist:
        """Drive on with the figure, or back to where it began."""
        pose = view.pose
        room = self._room or self._survey(view)
        if self._lost or view.time < self._rest_until:
            return STILL
        if self._begun is None:
            astray = math.dist((pose.x, pose.y), (self._home.x, self._home.y)) > ASTRAY
            if self._returns or astray:
                return self._back(view)
            self._begun, self._turned, self._heading = (view.time, pose), 0.0, pose.theta
        part = FIGURE[self._part]
        self._turned += wrap(pose.theta - self._heading)
        self._heading = pose.theta
        time, start = self._begun
        way = math.dist((pose.x, pose.y), (start.x, start.y))
        if not self._can_stop_in(room, view, part):
            self._returns, self._nearest = True, math.inf
            self._rest(view.time)
            self._part = (self._part + 1) % len(FIGURE)
            return STILL
        if way >= part.way * _reach(room) or abs(self._turned) >= part.turn or view.time >= time + part.seconds:
            self._rest(view.time)
            self._part = (self._part + 1) % len(FIGURE)
            return STILL
        return self._twist(part.ahead, part.turning)

    def _survey(self, view: View) -> Region:
        """Find out where it may drive."""
        field, here = view.zone("field"), view.pose
        x_min, y_min, x_max, y_max = ROOM.bounds
        room = field or Rectangle(here.x + x_min, here.y + y_min, here.x + x_max, here.y + y_max)
        (x_min, y_min, x_max, y_max), self._room = room.bounds, room
        self._home = Pose((x_min + x_max) / 2, (y_min + y_max) / 2, here.theta)
        return room

    def _can_stop_in(self, room: Region, view: View, part: Part) -> bool:
        """True if the robot stays in the room, even if it begins to brake only at the next look."""
        v = self._twist(part.ahead, part.turning).v
        robot, pose = self.robot, view.pose
        way = abs(v) * (REACTION + robot.delay) + v * v / (2.0 * min(robot.a_max, robot.slowing or robot.a_max))
        return room.contains(*ahead(pose.x, pose.y, pose.theta, math.copysign(way, v) if v else 0.0))

    def _back(self, view: View) -> Twist:
        """The motion back to the middle of the room, and to the heading that it had at first."""
        home = self._home
        if not self._returns:
            self._returns, self._nearest = True, math.inf
        x, y = home.x - view.pose.x, home.y - view.pose.y
        far = math.hypot(x, y)
        self._nearest = min(self._nearest, far)
        if far > self._nearest + WRONG_WAY:
            self._lost = True
            return STILL
        error = wrap((atan2(y, x) if far > ARRIVED else home.theta) - view.pose.theta)
        if far <= ARRIVED and abs(error) <= ARRIVED:
            self._returns = False
            self._rest(view.time)
            return STILL
        if abs(error) > 0.3 or far <= ARRIVED:
            return self._twist(0.0, max(-SLOW, min(SLOW, error)))
        return self._twist(min(SLOW, far), 0.5 * error)

    def _rest(self, now: float) -> None:
        self._begun = None
        self._rest_until = now + REST

    def _twist(self, ahead: float, turning: float) -> Twist:
        """The motion of which each part is a share of the top speed of the wheels."""
        wheels = 2.0 * self.robot.v_max / self.robot.drivetrain.effective_track
        return Twist(ahead * self.robot.v_max, turning * min(wheels, self.robot.w_max))


def _reach(room: Region) -> float:
    """The way that it drives straight ahead, m."""
    x_min, y_min, x_max, y_max = room.bounds
    return min(x_max - x_min, y_max - y_min) / 2
