"""A racer steers by its compass where it has one, and tells its team how far it has still to go."""

import math

import numpy as np

from toys.compass import Compass
from vrg.agents import Action, Strategy, Twist, View


class Racer(Strategy):
    def act(self, view: View) -> Action:
        finish = view.zone("finish")
        compass = view.readings.latest(Compass)
        if finish is None or view.me.mark is not None:
            return Action()
        x, y = finish.middle
        heading = view.pose.theta if compass is None else compass.value.heading
        bearing = math.remainder(np.arctan2(y - view.pose.y, x - view.pose.x) - heading, 2 * math.pi)
        distance = np.hypot(x - view.pose.x, y - view.pose.y)
        # numpy's own numbers, as students write them
        return Action(Twist(np.float64(0.6), 1.5 * bearing), say={"left": distance})
