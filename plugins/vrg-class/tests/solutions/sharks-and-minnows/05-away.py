import math

from vrg.agents import *
from vrg.geometry import wrap


class Mine(Strategy):
    def act(self, view):
        x, y = view.position
        aim = (4.3, -1.0) if y > -0.5 else (x, -6.0)
        if y > 3.5 and x < 3.0:
            aim = (4.3, 4.5)
        error = wrap(math.atan2(aim[1] - y, aim[0] - x) - view.pose.theta)
        return Twist(0.7 if abs(error) < 0.8 else 0.1, 2.0 * error)
