"""The strategy of a robot that drives a figure, by which its numbers can be found."""

import math
from dataclasses import dataclass

from vrg.agents.strategy import Strategy, View
from vrg.geometry import wrap
from vrg.hal.models import RobotModel
from vrg.types import STILL, Pose, Twist

REST = 0.7
"""The time in s for which the robot stands after each part, so that it is seen how it stops."""
ASTRAY = 0.3
"""The distance in m from the start above which it drives back before it goes on."""
ARRIVED = 0.1
"""The distance in m, and the angle in rad, from where it is to be, at which it is there."""
SLOW = 0.4
"""The share of its top speed at which it drives back."""
ROOM = 1.0
"""The way in m that it drives ahead where no field is given."""


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

    The field is that of the practice match; half its smaller side is the way that it drives straight ahead.
    """

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._home: Pose | None = None
        self._part = 0
        self._begun: tuple[float, Pose] | None = None
        self._turned = 0.0
        self._heading = 0.0
        self._rest_until = 0.0
        self._returns = False

    @property
    def mode(self) -> str:
        """The part of the figure that it drives."""
        return "Returning" if self._returns else f"Part {self._part + 1} of {len(FIGURE)}"

    def act(self, view: View) -> Twist:
        """Drive on with the figure, or back to where it began."""
        pose = view.pose
        if self._home is None:
            self._home = pose
        if view.time < self._rest_until:
            return STILL
        if self._begun is None:
            astray = math.dist((pose.x, pose.y), (self._home.x, self._home.y)) > ASTRAY
            if self._returns or astray:
                return self._back(view, self._home)
            self._begun, self._turned, self._heading = (view.time, pose), 0.0, pose.theta
        part = FIGURE[self._part]
        self._turned += wrap(pose.theta - self._heading)
        self._heading = pose.theta
        time, start = self._begun
        way = math.dist((pose.x, pose.y), (start.x, start.y))
        if way >= part.way * _room(view) or abs(self._turned) >= part.turn or view.time >= time + part.seconds:
            self._rest(view.time)
            self._part = (self._part + 1) % len(FIGURE)
            return STILL
        return self._twist(part.ahead, part.turning)

    def _back(self, view: View, home: Pose) -> Twist:
        """The motion back to where it began, and to its heading there."""
        self._returns = True
        x, y = home.x - view.pose.x, home.y - view.pose.y
        far = math.hypot(x, y)
        error = wrap((math.atan2(y, x) if far > ARRIVED else home.theta) - view.pose.theta)
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


def _room(view: View) -> float:
    """The way that it drives straight ahead, m."""
    field = view.zone("field")
    if field is None:
        return ROOM
    x_min, y_min, x_max, y_max = field.bounds
    return min(x_max - x_min, y_max - y_min) / 2
