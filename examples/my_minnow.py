"""A minnow of one's own: it hugs the border on the side where fewer sharks are, then runs home."""

from vrg.agents import STILL, Twist, View
from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer
from vrg.navigation.avoidance import Obstacle, steer
from vrg.navigation.control import linearise, scaled


class WallHugger(SharksAndMinnowsPlayer):
    """Plays like the others, save while it crosses."""

    def _cross(self, view: View) -> Twist:
        field, safe = view.zone("field"), view.zone("safe")
        if field is None or safe is None:
            return STILL
        others = view.others()
        sharks = [p.pose.x for p in others if p.role == "shark" and p.pose is not None]
        middle, _ = field.middle
        left_is_safer = sum(x > middle for x in sharks) >= sum(x < middle for x in sharks)
        lanes = field.shrunk(0.8)
        x_min, _, x_max, _ = lanes.bounds
        lane = x_min if left_is_safer else x_max

        home = safe.shrunk(0.5).nearest(*view.position)
        wanted = scaled((2 * (lane - view.pose.x), home[1] - view.pose.y), self.robot.v_max)
        bodies = [
            Obstacle((p.pose.x, p.pose.y), view.velocities.get(p.name, (0.0, 0.0)), p.radius + view.me.radius + 0.15)
            for p in others
            if p.pose is not None
        ]
        return linearise(steer(view.position, wanted, bodies, lanes, horizon=2.5), view.pose.theta, d=0.25)
