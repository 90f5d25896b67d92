from vrg.agents import *


class Mine(Strategy):
    def act(self, view):
        for thing in view.referee.objects:
            if thing.team != view.me.team:
                print(thing.x, thing.y)
        return Twist(0.3, 0.0)
