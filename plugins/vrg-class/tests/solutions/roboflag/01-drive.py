from vrg.agents import *


class Mine(Strategy):
    def act(self, view):
        return Twist(0.7, 0.0)
