"""A player of one's own that uses the compass: it drives north."""

import math

from my_robot.compass import Compass
from vrg.agents import Strategy, View
from vrg.geometry import wrap
from vrg.portable.scalars import cos
from vrg.types import STILL, Twist


class Northbound(Strategy):
    """Turns until the compass shows +y, and drives that way."""

    mode = "North"

    def act(self, view: View) -> Twist:
        """Turn towards north; drive the faster the nearer the heading is to it."""
        compass = view.readings.latest(Compass)
        if compass is None:
            return STILL
        error = wrap(math.pi / 2 - compass.value.heading)
        return Twist(self.robot.v_max * max(0.0, cos(error)), 2.0 * error)
