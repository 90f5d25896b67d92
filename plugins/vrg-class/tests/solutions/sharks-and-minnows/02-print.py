from vrg.agents import *


class Mine(Strategy):
    def act(self, view):
        print(view.position)
        return Twist(0.7, 0.0)
