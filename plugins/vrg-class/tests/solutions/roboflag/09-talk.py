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
        for blue in view.others():
            if blue.team != view.me.team and blue.pose.x < -0.2 and blue.state != "tagged":
                return to(view, blue.pose.x, blue.pose.y)
        side = -1.0 if view.me.name == "red1" else 1.0
        return to(view, -2.0, side) if math.dist(view.position, (-2.0, side)) > 0.3 else STILL
