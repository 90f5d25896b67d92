"""The strategy of an aerial scout: it flies over the area, reports who is below, and stays above whom it has found."""

import math

from vrg.agents.flying import above, patrol
from vrg.agents.strategy import Action, Strategy, View
from vrg.bus.messages import Sighting
from vrg.games.pursuit_evasion import AREA, SIGHTINGS_AT_ONCE
from vrg.games.pursuit_evasion.talk import words
from vrg.games.pursuit_evasion.watch import IntruderDetector
from vrg.hal.models import RobotModel
from vrg.hal.sensors.downward import Overview, OverviewSpec
from vrg.hal.sensors.odometry import Odometry
from vrg.portable.scalars import cos_sin, square
from vrg.types import STILL, Vector

POSITION = 0.05
"""The standard deviation of its own place when it reports others, m."""


class Scout(Strategy):
    """Flies at its ceiling, on a circle over the area, until it sees a robot that its team does not know. Then it stays
    above the nearest of these, so that pursuers learn its course, until it is out of play."""

    games = ("pursuit-evasion",)
    mode = "Scout/Patrol"

    def __init__(self, name: str, robot: RobotModel) -> None:
        super().__init__(name, robot)
        self._watch = IntruderDetector(robot)
        self._stamp = -math.inf
        self._found: list[Sighting] = []

    def act(self, view: View) -> Action:
        """Look down, fly, and report to the team and the referee."""
        self._watch.look(view, standing=False)
        fresh = self._seen(view)
        area = view.zone(AREA)
        if area is None or not view.me.may_move:
            return Action(STILL, say=words(view.pose, STILL, fresh, None), sightings=fresh)
        self.mode = "Scout/Follow" if self._found else "Scout/Patrol"
        if view.me.mark is not None:
            self.mode, aim = "Scout/LineUp", (view.me.mark.x, view.me.mark.y)
        elif self._found:
            aim = min(((s.x, s.y) for s in self._found), key=lambda place: math.dist(place, view.position))
        else:
            aim = patrol(view, area)
        odometry = view.readings.latest(Odometry)
        moves = STILL if odometry is None else odometry.value.twist
        return Action(above(view, aim), say=words(view.pose, moves, fresh, None), sightings=fresh)

    def _seen(self, view: View) -> list[Sighting]:
        """The robots below that are no team mates and in play, if there is a new picture."""
        sample, spec = view.readings.latest(Overview), self.robot.sensor(OverviewSpec)
        if sample is None or spec is None or sample.stamp <= self._stamp or view.pose.z <= 0.0:
            return []
        self._stamp, self._found = sample.stamp, []
        known = self._watch.known(view, view.time)
        cos, sin = cos_sin(view.pose.theta)
        for ahead, left in sample.value.places:
            place: Vector = view.pose.x + ahead * cos - left * sin, view.pose.y + ahead * sin + left * cos
            if any(math.dist(place, other) < far for other, far in known):
                continue
            variance = square(spec.deviation(view.pose.z, (ahead, left))) + square(POSITION)
            self._found.append(Sighting(x=place[0], y=place[1], time=sample.stamp, xx=variance, xy=0.0, yy=variance))
        return self._found[:SIGHTINGS_AT_ONCE]
