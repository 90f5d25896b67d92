"""A planner that leads every player of a match around the obstacles of the map, whatever its strategy is."""

import math

from vrg.agents import View
from vrg.agents.planner import Planner
from vrg.hal.models import RobotModel
from vrg.navigation.pilot import CLEARANCE, Pilot
from vrg.regions import Circle
from vrg.types import Twist

EVERYWHERE = Circle(0.0, 0.0, 1e5)


class Around(Planner):
    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._pilot = Pilot()

    def plan(self, view: View, twist: Twist) -> Twist:
        here, margin = view.position, view.me.radius + CLEARANCE
        near = [(wall, margin) for wall in view.obstacles if wall.distance(*here) < margin + twist.v]
        if not near:
            return twist
        wanted = twist.v * math.cos(view.pose.theta), twist.v * math.sin(view.pose.theta)
        return self._pilot.head(view.time, view.pose, wanted, [], EVERYWHERE, near)
