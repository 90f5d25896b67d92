from vrg.agents import *


class Mine(Strategy):
    def act(self, view):
        if view.time < 3.0:
            return Twist(0.0, 1.0)
        return Twist(0.7, 0.0)
