"""A player of Sharks and Minnows. It plays by simple rules: change them, and play again.

`act` is called ten times a second. It is shown a view of the match, and it answers how the robot drives until the next
call. Lengths are in metres, speeds in m/s, angles in radians counter-clockwise from +x. docs/api.md of VRG lists
everything that a view tells.
"""

import math

from vrg.agents import STILL, Strategy, Twist, View
from vrg.agents.interception import intercept
from vrg.navigation.avoidance import Obstacle, steer
from vrg.navigation.control import linearise, scaled
from vrg.types import Vector

BORDER = 0.7
"""The distance to keep from the border of the field, m. A player whose centre leaves the field is out."""
CLEARANCE = 0.15
"""The distance to keep from other robots, m."""
FEAR = 4.0
"""The distance at which a minnow begins to keep away from a shark, m."""
DEEP = 0.8
"""The distance that a minnow drives into the safe zone before it stops, m, so that others have room behind it."""


class Ann(Strategy):
    """Lines up, crosses the field as a minnow, and chases the nearest minnow as a shark."""

    doing = "waits"

    @property
    def mode(self) -> str:
        """What the window shows beside the robot."""
        return self.doing

    def act(self, view: View) -> Twist:
        """Decide how to drive now. Twist(v, w): v in m/s ahead, w in rad/s to the left."""
        if not view.me.may_move:
            self.doing = "waits"
            return STILL
        if view.me.mark is not None:  # the round has not begun: drive to the place where the referee wants you
            self.doing = "lines up"
            return self.drive_to(view, (view.me.mark.x, view.me.mark.y))
        if view.me.role == "shark":
            return self.hunt(view)
        return self.cross(view)

    def cross(self, view: View) -> Twist:
        """As a minnow: drive to the safe zone, and keep away from sharks that are near."""
        safe = view.zone("safe")
        if safe is None:  # in practice there are no zones: drive in a circle, so that something is seen
            self.doing = "practises"
            return Twist(0.4, 0.5)
        if safe.shrunk(DEEP).contains(*view.position):
            self.doing = "is safe"
            return STILL
        self.doing = "crosses"
        x, y = view.position
        home_x, home_y = safe.shrunk(DEEP + 0.2).nearest(x, y)
        # An arrow of length 1 leads home. Each shark that is near adds an arrow away from it: the nearer, the longer.
        arrow_x, arrow_y = scaled((home_x - x, home_y - y), 1.0)
        for other in view.others():
            if other.role == "shark" and other.state == "active" and other.pose is not None:
                distance = math.dist((x, y), (other.pose.x, other.pose.y))
                if distance < FEAR:
                    self.doing = "flees"
                    away_x, away_y = scaled((x - other.pose.x, y - other.pose.y), 2.0 * (FEAR - distance) / FEAR)
                    arrow_x, arrow_y = arrow_x + away_x, arrow_y + away_y
        return self.drive(view, scaled((arrow_x, arrow_y), self.robot.v_max))

    def hunt(self, view: View) -> Twist:
        """As a shark: drive at full speed to where a minnow can be met, and leave it to a shark that is nearer."""
        safe, others = view.zone("safe"), [p for p in view.others() if p.state == "active" and p.pose is not None]
        sharks = [(p.pose.x, p.pose.y) for p in others if p.role == "shark"]
        soonest, goal, name = math.inf, None, ""
        for other in others:
            place, velocity = (other.pose.x, other.pose.y), view.velocities.get(other.name, (0.0, 0.0))
            if other.role == "shark" or (safe is not None and safe.contains(*place)):
                continue
            met = intercept(view.position, 0.8, place, velocity, reach=view.me.radius + other.radius)
            distance = math.dist(view.position, place)
            seconds = 100 + distance if met is None else met.time
            if any(math.dist(shark, place) < distance for shark in sharks):
                seconds += 8  # rather one that no other shark is nearer to
            if seconds < soonest:
                soonest, goal, name = seconds, place if met is None else met.point, other.name
        if goal is None:
            self.doing = "waits"
            return STILL
        self.doing = f"hunts {name}"
        velocity = scaled((goal[0] - view.pose.x, goal[1] - view.pose.y), self.robot.v_max)
        velocity = steer(view.position, velocity, [], view.zone("field").shrunk(BORDER), horizon=2.5)
        return linearise(velocity, view.pose.theta, d=0.5)

    def drive_to(self, view: View, goal: Vector, prey: str = "") -> Twist:
        """Drive to a point of the field, and slow down shortly before it."""
        field = view.zone("field")
        x, y = goal if field is None else field.shrunk(BORDER).nearest(*goal)
        distance = math.dist(view.position, (x, y))
        if distance < 0.15:
            return STILL
        speed = min(self.robot.v_max, max(0.15, distance))
        return self.drive(view, scaled((x - view.pose.x, y - view.pose.y), speed), prey, min(2.5, distance / speed))

    def drive(self, view: View, velocity: Vector, prey: str = "", horizon: float = 2.5) -> Twist:
        """Drive with this velocity (x and y, m/s), but around the other robots and inside the field.

        Robots are avoided that would be in the way within `horizon` seconds; the prey is not avoided.
        """
        others = [
            Obstacle(
                (other.pose.x, other.pose.y),
                view.velocities.get(other.name, (0.0, 0.0)),
                view.me.radius + other.radius + CLEARANCE,
            )
            for other in view.others()
            if other.pose is not None and other.name != prey
        ]
        field = view.zone("field")
        if field is not None:
            velocity = steer(view.position, velocity, others, field.shrunk(BORDER), horizon)
        # The robot cannot drive sideways, so a point 0.25 m ahead of its centre is moved with this velocity.
        return linearise(velocity, view.pose.theta, d=0.25)
