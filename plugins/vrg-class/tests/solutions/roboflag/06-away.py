import math

from vrg.agents import *
from vrg.geometry import wrap


def to(view, x, y, speed=0.7):
    error = wrap(math.atan2(y - view.pose.y, x - view.pose.x) - view.pose.theta)
    return Twist(speed if abs(error) < 1.0 else 0.0, 2.0 * error)


def flag(view):
    return next((thing.x, thing.y) for thing in view.referee.objects if thing.team != view.me.team)


def home(view):
    return next(z.region.middle for z in view.referee.zones if z.kind == "home" and z.team == view.me.team)


class Mine(Strategy):
    def act(self, view):
        blue = view.others()[0]
        distance = math.dist((blue.pose.x, blue.pose.y), view.position)
        if view.me.state == "flagged":
            x, y = home(view)
        else:
            x, y = flag(view)
        if distance < 2.0:
            dx, dy = view.position[0] - blue.pose.x, view.position[1] - blue.pose.y
            return to(view, view.position[0] + dx, view.position[1] + dy)
        return to(view, x, y)
