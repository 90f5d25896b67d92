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
        if view.me.name == "red2":
            return to(view, -5.0, 2.5) if view.position[0] > -4.5 else STILL
        x, y = home(view) if view.me.state == "flagged" else flag(view)
        for blue in view.others():
            if blue.team == view.me.team:
                continue
            dx, dy = view.position[0] - blue.pose.x, view.position[1] - blue.pose.y
            if math.hypot(dx, dy) < 2.0:
                return to(view, view.position[0] + dx, view.position[1] + dy)
        return to(view, x, y)
