import math

from vrg.agents import *
from vrg.geometry import wrap


class Mine(Strategy):
    def act(self, view):
        x, y = view.position
        if y < -5.0:
            return STILL
        ax, ay = 0.0, -1.0
        for shark in view.others():
            if shark.role != "shark":
                continue
            dx, dy = x - shark.pose.x, y - shark.pose.y
            distance = math.hypot(dx, dy)
            if dy > -0.5:
                away = 4.0 / distance**2
                ax += away * (dx + (0.4 if x > shark.pose.x else -0.4)) / distance
                ay += away * dy / distance
        for side in (-4.7, 4.7):
            ax += 0.3 / (x - side) if abs(x - side) > 0.05 else 0.0
        error = wrap(math.atan2(ay, ax) - view.pose.theta)
        return Twist(0.7 if abs(error) < 1.2 else 0.1, 2.5 * error)
