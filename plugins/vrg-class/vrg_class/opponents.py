"""Simple players against which the first steps of a lesson are played."""

import math
from typing import Final

from vrg.agents import STILL, Strategy, Twist, View
from vrg.geometry import wrap
from vrg.portable.scalars import atan2

SLOW: Final = 0.35
"""The speed of the slow ones, m/s."""
_GAIN: Final = 2.0
"""The turn in rad/s for each rad of the way to turn."""


def towards(view: View, x: float, y: float, speed: float) -> Twist:
    """The motion to a place, m: it turns first, and drives ahead once it looks there."""
    error = wrap(atan2(y - view.pose.y, x - view.pose.x) - view.pose.theta)
    return Twist(speed if abs(error) < math.pi / 4 else 0.0, max(-1.5, min(1.5, _GAIN * error)))


class Still(Strategy):
    """Stands where it is."""

    def act(self, view: View) -> Twist:
        """See `Strategy`."""
        return STILL


class Patrol(Strategy):
    """Drives to and fro across the middle of the field, and looks at nobody."""

    def __init__(self, name: str, robot: object) -> None:
        super().__init__(name, robot)  # type: ignore[arg-type]
        self._side = 1.0

    def act(self, view: View) -> Twist:
        """See `Strategy`."""
        field = view.zone("field")
        if field is None:
            return STILL
        low_x, low_y, high_x, high_y = field.bounds
        x, y = (low_x + high_x) / 2 + self._side * (high_x - low_x) / 4, (low_y + high_y) / 2
        if math.dist(view.position, (x, y)) < SLOW:
            self._side = -self._side
        return towards(view, x, y, SLOW)


class Slow(Strategy):
    """Goes for the nearest player of another team that may be caught, slowly."""

    def act(self, view: View) -> Twist:
        """See `Strategy`."""
        others = [
            one for one in view.others()
            if one.team != view.me.team and one.state not in ("inactive", "tagged", "disqualified")
        ]  # fmt: skip
        if not others:
            return STILL
        near = min(others, key=lambda one: math.dist((one.pose.x, one.pose.y), view.position))  # type: ignore[union-attr]
        assert near.pose is not None
        return towards(view, near.pose.x, near.pose.y, SLOW)
