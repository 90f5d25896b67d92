import math

from vrg.agents import *
from vrg.geometry import wrap


class Mine(Strategy):
    def act(self, view):
        x, y = view.position
        safe, field = view.zone("safe"), view.zone("field")
        if view.me.mark is not None and not view.me.may_move:
            return STILL
        if view.me.role == "shark":
            return STILL
        if safe is None:
            return STILL
        if view.me.mark is not None and view.referee.stage != "play_round":
            return self.to(view, view.me.mark.x, view.me.mark.y)
        left, _, right, _ = field.bounds
        _, sy = safe.middle
        if math.dist((x, y), safe.nearest(x, y)) == 0.0 and abs(y - sy) < 1.2:
            return STILL
        ahead = 1.0 if sy > y else -1.0
        ax, ay = 0.0, ahead
        for other in view.others():
            if other.state == "disqualified":
                continue
            dx, dy = x - other.pose.x, y - other.pose.y
            distance = max(0.3, math.hypot(dx, dy))
            if other.role == "shark" and other.state == "active":
                if dy * ahead < 0.5:
                    away = 6.0 / distance**2
                    ax += away * (dx + math.copysign(0.4, dx)) / distance
                    ay += away * dy / distance
            elif distance < 1.5:
                ax += 0.5 * dx / distance**2
                ay += 0.5 * dy / distance**2
        ax += 0.6 / max(0.1, x - left) - 0.6 / max(0.1, right - x)
        return self.to(view, x + ax, y + ay)

    def to(self, view, x, y):
        error = wrap(math.atan2(y - view.pose.y, x - view.pose.x) - view.pose.theta)
        return Twist(0.7 if abs(error) < 1.2 else 0.1, 2.5 * error)
