"""A lion that keeps on the radius of the man, and a man that runs."""

import math

from lion_and_man import LION
from vrg.agents import Strategy, View
from vrg.agents.pursuit import lion_move
from vrg.geometry import ahead
from vrg.navigation.control import linearise, scaled
from vrg.types import STILL, Twist, Vector

OFFSET = 0.2
"""The distance from a robot's centre to the point that is steered, m."""
BORDER = 0.6
"""How far both stay from the border, m: a little more than a robot needs to turn."""
STEP = 0.6
"""The length of a move that both plan, m."""


class Lion(Strategy):
    """Stays on the segment from the centre of the arena to the man, and goes outwards on it (Sgall, 2001)."""

    mode = "Hunt"

    def act(self, view: View) -> Twist:
        """Make the lion's move towards where the man will be after it."""
        arena, men = view.zone("field"), view.others()
        if arena is None or not men or men[0].pose is None:
            return STILL
        man, velocity = men[0].pose, view.velocities.get(men[0].name, (0.0, 0.0))
        ahead = STEP / self.robot.v_max
        soon = arena.nearest(man.x + velocity[0] * ahead, man.y + velocity[1] * ahead)
        goal = lion_move(arena.middle, view.position, soon, STEP)
        return self._go((goal[0] - view.position[0], goal[1] - view.position[1]), view)

    def _go(self, way: Vector, view: View) -> Twist:
        return linearise(scaled(way, self.robot.v_max), view.pose.theta, OFFSET)


class Man(Strategy):
    """Looks at moves in all directions, and takes the one after which the lion is farthest, but not into a corner."""

    mode = "Run"

    def act(self, view: View) -> Twist:
        """Take the best of 32 moves."""
        arena = view.zone("field")
        lions = [p.pose for p in view.others() if p.role == LION and p.pose is not None]
        if arena is None or not lions:
            return STILL
        lion, inner = (lions[0].x, lions[0].y), arena.shrunk(BORDER)

        def worth(way: Vector) -> float:
            """The distance from the lion after a move, and a little for every metre that is left to the border."""
            goal = inner.nearest(view.position[0] + way[0], view.position[1] + way[1])
            room = math.dist(goal, arena.middle)
            return math.dist(goal, lion) - 0.02 * room * room + 0.3 * math.dist(goal, view.position)

        ways = [ahead(0.0, 0.0, math.tau * i / 32, STEP) for i in range(32)]
        best = max(ways, key=worth)
        goal = inner.nearest(view.position[0] + best[0], view.position[1] + best[1])
        way = (goal[0] - view.position[0], goal[1] - view.position[1])
        return linearise(scaled(way, self.robot.v_max), view.pose.theta, OFFSET)
