"""Two wrestlers: a bull that goes straight at the other, and a matador that waits at the edge and steps aside.

Who stands or drives holds against an equal robot, but who turns slips, and gives way. So neither can push the other
straight out, and what wins are the charges that miss, the turns at a bad moment, and the middle of the ring.
"""

import math

from vrg.agents import Strategy, View
from vrg.geometry import ahead, wrap
from vrg.hal.models import RobotModel
from vrg.navigation.control import linearise, scaled
from vrg.portable.scalars import atan2, cos
from vrg.regions import Region
from vrg.types import STILL, Pose, Twist, Vector

OFFSET = 0.2
"""The distance from a robot's centre to the point that is steered, m."""
EDGE = 0.15
"""How far a robot's centre stays from the edge, m."""
REACTION = 0.2
"""The time in s from a look to when a command counts."""
CLOSE = 0.75
"""The distance of the two centres in m below which they touch, or nearly."""
GAINED = 0.1
"""The distance in m by which a wrestler gets ahead if it does not push in vain."""
STUCK, BACK = 1.0, 0.6
"""The time in s for which a wrestler pushes in vain, and the time for which it then backs off."""
AHEAD = 0.5
"""The angle in rad from a robot's front within which the other is right ahead of it."""
BLIND = 1.1
"""The distance in m from the other within which a bull forgets the edge."""
WAIT = 0.5
"""How far a matador's centre is from the edge when it waits, m."""
DASH = 1.2
"""The distance in m from a charging robot at which a matador dashes out of its way."""
THRUST = 2.0
"""The distance in m from which a matador thrusts."""
ARC = 1.5
"""The turn rate in rad/s with which a matador backs off, so that the other slips past."""


class Wrestler(Strategy):
    """What both know: to stay in the ring, and to back off from a push in vain when the other has the middle."""

    games = ("sumo",)

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._gained: tuple[float, Vector] = (0.0, (math.inf, math.inf))
        """When, s, and where, m, it last got ahead."""
        self._back_until = 0.0
        self._mode = "Wait"

    @property
    def mode(self) -> str:
        """What it is doing."""
        return self._mode

    def act(self, view: View) -> Twist:
        """Fight, but back off from a push in vain, and from the edge."""
        ring, others = view.zone("field"), view.others()
        if ring is None or not others or others[0].pose is None or view.me.mark is not None:
            return STILL
        pose, foe = view.pose, others[0].pose
        if not view.me.may_move or math.dist(view.position, self._gained[1]) > GAINED:
            self._gained = view.time, view.position
        outer = math.dist(view.position, ring.middle) > math.dist((foe.x, foe.y), ring.middle)
        in_vain = distance(pose, foe) < CLOSE and view.time - self._gained[0] > STUCK
        if in_vain and outer and view.time > self._back_until:
            self._back_until = view.time + BACK
        if view.time < self._back_until:
            self._mode = "Back off"
            wanted = Twist(-self.robot.v_max if abs(bearing(pose, foe)) < math.pi / 2 else self.robot.v_max, self.arc)
        else:
            wanted = self.fight(pose, foe, ring)
        if self.forgets_the_edge(pose, foe) or self._stays(pose, wanted.v, ring):
            return wanted
        self._mode = "Edge"
        return self.towards(pose, ring.middle)

    arc = 0.0
    """The turn rate with which it backs off, rad/s."""

    def fight(self, pose: Pose, foe: Pose, ring: Region) -> Twist:
        """What it does if nothing else is the matter."""
        raise NotImplementedError

    def forgets_the_edge(self, pose: Pose, foe: Pose) -> bool:
        """True if it drives on whatever the edge."""
        return False

    def towards(self, pose: Pose, goal: Vector) -> Twist:
        """Drive to a place, m, at top speed."""
        way = goal[0] - pose.x, goal[1] - pose.y
        return linearise(scaled(way, self.robot.v_max), pose.theta, OFFSET)

    def _stays(self, pose: Pose, v: float, ring: Region) -> bool:
        """True if it can still stop in the ring after it has driven at a speed, m/s, until the next look."""
        way = abs(v) * REACTION + v * v / (2 * self.robot.a_max)
        return ring.shrunk(EDGE).contains(*ahead(pose.x, pose.y, pose.theta, math.copysign(way, v)))


class Bull(Wrestler):
    """Goes straight at the other, and near it forgets the edge."""

    def fight(self, pose: Pose, foe: Pose, ring: Region) -> Twist:
        """Charge, with the front ahead."""
        self._mode = "Charge"
        twist = self.towards(pose, (foe.x, foe.y))
        return Twist(max(0.0, twist.v), twist.w)

    def forgets_the_edge(self, pose: Pose, foe: Pose) -> bool:
        """True while the other is near and right ahead."""
        return distance(pose, foe) < BLIND and abs(bearing(pose, foe)) < AHEAD


class Matador(Wrestler):
    """Waits at the edge, abeam of the other, dashes out of the line of its charge, and thrusts at it from inside."""

    arc = ARC

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._dash = 0.0
        """The speed of its dash, m/s."""

    def fight(self, pose: Pose, foe: Pose, ring: Region) -> Twist:
        """Thrust, dash, hold, or wait for the charge."""
        apart, abeam, seen = distance(pose, foe), bearing(pose, foe), bearing(foe, pose)
        depth, depth_of_foe = (-ring.signed_distance(at.x, at.y) for at in (pose, foe))
        if depth_of_foe < depth and abs(seen) > AHEAD and apart < THRUST:
            self._mode = "Thrust"
            return self._nearest_end(abeam)
        if apart < DASH and abs(seen) < 2 * AHEAD:
            if abs(cos(abeam)) > 0.7:
                self._mode = "Hold"
                return self._nearest_end(abeam)
            if self._mode != "Dash":
                fore, aft = (math.dist(ahead(pose.x, pose.y, pose.theta, way), ring.middle) for way in (0.5, -0.5))
                self._dash = self.robot.v_max if fore < aft else -self.robot.v_max
            self._mode = "Dash"
            return Twist(self._dash, 0.0)
        self._mode = "Wait"
        if depth > WAIT:
            return self._nearest_end(wrap(abeam + math.pi))
        return Twist(0.0, max(-2.0, min(2.0, 3.0 * wrap(abeam - math.copysign(math.pi / 2, abeam)))))

    def _nearest_end(self, way: float) -> Twist:
        """Drive in a direction, rad in its own frame, with that end ahead that has to turn less."""
        back = abs(way) > math.pi / 2
        error = wrap(way + math.pi) if back else way
        return Twist((-1.0 if back else 1.0) * self.robot.v_max * max(0.0, cos(error)), 4.0 * error)


def distance(pose: Pose, other: Pose) -> float:
    """The distance of two centres, m."""
    return math.dist((pose.x, pose.y), (other.x, other.y))


def bearing(pose: Pose, other: Pose) -> float:
    """The direction from one robot to another in the frame of the first, rad: 0 is straight ahead."""
    return wrap(atan2(other.y - pose.y, other.x - pose.x) - pose.theta)
