"""A footballer: the nearest of a team goes to the ball, the keeper stays in the goal, and the others find places."""

import math

from vrg.agents import Action, Strategy, View
from vrg.bus.messages import FieldObject, PlayerStatus
from vrg.geometry import ahead, along_arc, wrap
from vrg.hal.models import RobotModel
from vrg.hal.sensors.odometry import Odometry
from vrg.navigation.control import limit, linearise, scaled, track
from vrg.portable.scalars import atan2
from vrg.regions import Region
from vrg.types import STILL, Pose, Twist, Vector

OFFSET = 0.1
"""The distance from a robot's centre to the point that is steered, m."""
BEHIND = 0.12
"""The distance behind the ball, besides their radii, from which a robot goes for it, m."""
AROUND = 0.3
"""The distance at which a robot drives around the ball, m."""
KEEP_OFF = 0.62
"""How far a robot stays away from a kick of the others, m."""
FRONT = 0.2
"""How far field players stay in front of defence areas, m."""
PASS = 0.2
"""How far a robot passes by another one, m."""
STRAIGHT = 0.12
"""The error of the direction up to which a robot sends the ball ahead, rad."""
MISS = 0.2
"""How far beside the place that it aims at a shot may cross the goal line, m."""
PLATE = 0.05
"""The distance in m beside that line up to which the kicker meets the ball."""
ASIDE = 0.15
"""The distance in m beside the line through the ball to the goal from which a robot drives straight at the ball."""
TURN = 5.0
"""The rate at which a robot turns on the spot, rad/s."""
GLIDE = 0.7
"""The speed of a keeper along its line, m/s."""
DECISION = 0.1
"""The time in s between two decisions, by which what the referee publishes is old."""
CORNER = 0.45
"""How far beside the middle of the goal it is shot at, m."""
SHOT, TAP = 6.0, 2.2
"""The speeds of a shot at the goal, and of a ball that is only sent ahead, m/s."""
FAR = 5.5
"""The distance to the goal from which it is shot at, m."""


class Footballer(Strategy):
    """Plays as the keeper or as a field player, by its role."""

    games = ("soccer",)
    priorities = ("attack", "defend")

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._mode = "-"
        self._here = Pose(0.0, 0.0, 0.0)

    @property
    def _place(self) -> Vector:
        return self._here.x, self._here.y

    @property
    def mode(self) -> str:
        """What it does."""
        return self._mode

    def act(self, view: View) -> Twist | Action:
        """Line up, keep the goal, go for the ball, or find a place."""
        # Where the referee saw it one decision ago is known better than what the robot measures of itself.
        odometry = view.readings.latest(Odometry)
        seen, twist = view.me.pose or view.pose, STILL if odometry is None else odometry.value.twist
        self._here = along_arc(seen, twist, DECISION)
        ball, field = view.thing("ball"), view.zone("field")
        goals = {zone.team: zone.region for zone in view.referee.zones if zone.kind == "goal"}
        own = goals.get(view.me.team)
        theirs = next((region for team, region in goals.items() if team != view.me.team), None)
        if view.me.mark is not None:
            return self._line_up(view, view.me.mark)
        if ball is None or field is None or own is None or theirs is None:
            return STILL
        home, target = own.middle, theirs.middle
        if view.me.role.endswith("keeper"):
            return self._keep(view, ball, home)
        mates = [p for p in view.referee.players if p.team == view.me.team and _plays(p)]
        areas = [zone.region for zone in view.referee.zones if zone.kind == "area"]
        if self._kick_of_others(view) or any(area.contains(ball.x, ball.y) for area in areas):
            self._mode = "Wait"  # in a defence area the ball is its keeper's
            return self._wait(view, ball, home, field, KEEP_OFF + 0.3 * mates.index(view.me))
        order = sorted(mates, key=lambda p: (self._cost(p, ball, target), p.name))
        if order[0].name == view.me.name:
            return self._attack(view, ball, target, field)
        return self._support(view, ball, home, target, field, order.index(view.me))

    def _line_up(self, view: View, mark: Pose) -> Twist:
        self._mode = "Line up"
        if math.dist(self._place, (mark.x, mark.y)) > 0.1:
            return self._drive(view, (mark.x, mark.y), view.robot.v_max)
        return _turn(wrap(mark.theta - self._here.theta))

    def _keep(self, view: View, ball: FieldObject, home: Vector) -> Twist | Action:
        """Stand between the ball and the goal, and clear a ball that is near."""
        self._mode = "Keep"
        line = home[0] - math.copysign(0.3, home[0])
        soon = ball.y + 0.3 * ball.vy
        if ball.vx * home[0] > 0.2:  # it comes: where it will cross the line
            soon = ball.y + ball.vy * min(1.5, max(0.0, (line - ball.x) / ball.vx))
        place = (line, min(max(soon, home[1] - 0.45), home[1] + 0.45))
        near = math.hypot(ball.vx, ball.vy) < 0.5 and abs(ball.x - home[0]) < 0.75 and abs(ball.y) < 0.8
        if near and not self._kick_of_others(view):
            self._mode = "Clear"
            return self._strike(view, ball, (-home[0], 1.5 if ball.y >= 0.0 else -1.5), TAP * 2.0)
        if abs(self._here.x - line) > 0.12:
            return self._drive(view, place, view.robot.v_max)
        # Along the line, ahead or back: to turn takes longer than a ball that comes.
        up = math.copysign(math.pi / 2, self._here.theta)
        v = math.copysign(1.0, up) * max(-GLIDE, min(GLIDE, 3.0 * (place[1] - self._here.y)))
        error = wrap(up - self._here.theta)
        return Twist(v if abs(error) < 0.5 else 0.0, 4.0 * error + 4.0 * (self._here.x - line) * max(-0.5, min(0.5, v)))

    def _attack(self, view: View, ball: FieldObject, target: Vector, field: Region) -> Twist | Action:
        """Go for the ball; near the goal shoot, elsewhere send it ahead."""
        self._mode = "Attack"
        keeper = next((p.pose for p in view.others() if p.team != view.me.team and p.role.endswith("keeper")), None)
        aside = 0.0 if keeper is None else math.copysign(CORNER, -keeper.y if abs(keeper.y) > 0.02 else ball.y + 1e-9)
        goal = (target[0], target[1] + aside)
        far = math.dist((ball.x, ball.y), goal)
        if far < FAR:
            return self._strike(view, ball, goal, SHOT, min(STRAIGHT, MISS / far))
        return self._strike(view, ball, goal, TAP)

    def _strike(
        self, view: View, ball: FieldObject, target: Vector, speed: float, error: float = STRAIGHT
    ) -> Twist | Action:
        """Get behind the ball, and kick it at a target as soon as the direction is wrong by less than this, rad."""
        soon = (ball.x + 0.25 * ball.vx, ball.y + 0.25 * ball.vy)
        ux, uy = scaled((target[0] - soon[0], target[1] - soon[1]), 1.0)
        dx, dy = self._here.x - soon[0], self._here.y - soon[1]
        along, across = dx * ux + dy * uy, dx * -uy + dy * ux
        reach = ball.radius + view.robot.length / 2
        off = wrap(atan2(uy, ux) - self._here.theta)
        if along < -reach * 0.5 and abs(across) < ASIDE:
            # Straight at it; what it is beside the line is steered out on the way.
            aim = off - max(-0.5, min(0.5, 4.0 * across))
            w = max(-TURN, min(TURN, 5.0 * aim))
            if abs(aim) < 0.4:
                straight = abs(off) < error and abs(across) < PLATE
                twist = Twist(view.robot.v_max if straight else 0.5, w)
                return Action(twist, use={"kicker": speed}) if straight else twist
            return Twist(-0.2 if along > -reach - 0.04 else 0.0, w)
        place = soon[0] - (reach + BEHIND) * ux, soon[1] - (reach + BEHIND) * uy
        if along > -reach - 0.02:  # beside it, or in front of it: around it first
            side = math.copysign(AROUND, across)
            place = soon[0] - AROUND * ux - side * uy, soon[1] - AROUND * uy + side * ux
        return self._drive(view, place, view.robot.v_max)

    def _wait(self, view: View, ball: FieldObject, home: Vector, field: Region, distance: float) -> Twist:
        """Keep off the ball on the side of the own goal; beside it where a defence area leaves no room there."""
        bearing = atan2(home[1] - ball.y, home[0] - ball.x)
        places = [ahead(ball.x, ball.y, bearing + turn, distance) for turn in (0.0, 1.0, -1.0, 2.0, -2.0)]
        free = [place for place in places if math.dist(_free(view, place, field), (ball.x, ball.y)) > KEEP_OFF - 0.1]
        return self._to(view, (free or places)[0], field)

    def _support(
        self, view: View, ball: FieldObject, home: Vector, target: Vector, field: Region, number: int
    ) -> Twist:
        """The second one covers the own goal, the third waits before the other goal; further ones are beside them."""
        back = number % 2 == 1 if view.priority is None else view.priority == "defend"
        self._mode = "Cover" if back else "Wing"
        if back:
            share = 0.5 - 0.1 * (number // 2)
            place = home[0] + share * (ball.x - home[0]), home[1] + share * (ball.y - home[1])
        else:
            wing = -1.0 if ball.y > 0.0 else 1.0
            place = 0.5 * (ball.x + target[0]), target[1] + wing * (0.9 + 0.3 * (number // 2))
        if math.dist(place, (ball.x, ball.y)) < 0.5:
            place = _beside((ball.x, ball.y), home, 0.6)
        return self._to(view, place, field)

    def _to(self, view: View, place: Vector, field: Region) -> Twist:
        x, y = _free(view, place, field)
        if math.dist(self._place, (x, y)) < 0.1:
            ball = view.thing("ball")
            bearing = 0.0 if ball is None else atan2(ball.y - self._here.y, ball.x - self._here.x)
            return _turn(wrap(bearing - self._here.theta))
        return self._drive(view, (x, y), view.robot.v_max)

    def _drive(self, view: View, place: Vector, speed: float, *, avoid: bool = True) -> Twist:
        """Drive to a place, past the robots on the way."""
        wanted = limit(track(place, (0.0, 0.0), self._here, OFFSET, 2.5), speed)
        if avoid:
            wanted = self._past(view, wanted, math.dist(self._place, place))
        return linearise(wanted, self._here.theta, OFFSET)

    def _past(self, view: View, wanted: Vector, far: float) -> Vector:
        """Turn a wanted velocity aside from the nearest robot that is in the way."""
        ux, uy = scaled(wanted, 1.0)
        nearest, turned = min(far, 0.7), wanted
        for other in view.others():
            if other.pose is None:
                continue
            dx, dy = other.pose.x - self._here.x, other.pose.y - self._here.y
            along, across = dx * ux + dy * uy, dx * -uy + dy * ux
            if 0.0 < along < nearest and abs(across) < PASS:
                nearest = along
                side = -math.copysign(1.0 - abs(across) / PASS / 2, across)
                turned = scaled((ux - side * uy, uy + side * ux), math.hypot(*wanted))
        return turned

    @staticmethod
    def _kick_of_others(view: View) -> bool:
        """True while the other team has a free kick."""
        return any(name.startswith("kick for ") and not name.endswith(view.me.team) for name in view.referee.numbers)

    @staticmethod
    def _cost(player: PlayerStatus, ball: FieldObject, target: Vector) -> float:
        """The way of a player to the ball, in steps of 0.1 m; longer from in front of it."""
        if player.pose is None:
            return math.inf
        ux, uy = scaled((target[0] - ball.x, target[1] - ball.y), 1.0)
        dx, dy = player.pose.x - ball.x, player.pose.y - ball.y
        return math.floor(10.0 * (math.hypot(dx, dy) + max(0.0, dx * ux + dy * uy)))


def _turn(error: float) -> Twist:
    """Turn on the spot by an angle, rad."""
    return Twist(0.0, 0.0 if abs(error) < 0.05 else max(-TURN, min(TURN, 4.0 * error)))


def _free(view: View, place: Vector, field: Region) -> Vector:
    """The nearest point on the field in front of the defence areas."""
    x, y = field.nearest(*place)
    for area in (zone.region for zone in view.referee.zones if zone.kind == "area"):
        if area.distance(x, y) < FRONT:
            x = math.copysign(abs(area.nearest(0.0, y)[0]) - FRONT, area.middle[0])
    return x, y


def _plays(player: PlayerStatus) -> bool:
    return player.pose is not None and player.state != "disqualified" and not player.role.endswith("keeper")


def _beside(place: Vector, towards: Vector, distance: float) -> Vector:
    """The point at a distance, m, from a place towards another one."""
    return ahead(*place, atan2(towards[1] - place[1], towards[0] - place[0]), distance)
