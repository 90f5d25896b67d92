import math

from vrg.agents import *
from vrg.geometry import wrap


class Mine(Strategy):
    def act(self, view):
        x, y = view.zone("safe").nearest(*view.position)
        error = wrap(math.atan2(y - view.pose.y, x - view.pose.x) - view.pose.theta)
        return Twist(0.7, 2.0 * error)
