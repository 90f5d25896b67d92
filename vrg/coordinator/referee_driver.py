"""The coordinator's own driving of robots, such as the tagged players of RoboFlag (thesis 4.4.3).

It works out the motions; the referee's state has them, and the robots' devices and the world obey
(vrg.hal.permission).
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

from msgspec import structs

from vrg.bus.messages import Body, PlayerStatus, RefereeState
from vrg.navigation.avoidance import Obstacle
from vrg.navigation.pilot import CLEARANCE, Pilot
from vrg.portable.scalars import cos_sin
from vrg.regions import Circle, Region
from vrg.types import STILL, Twist, Vector

REGION_DEPTH = 0.05
"""The distance in m into its region to which a robot is driven. So it does not bar the way of those that come after
it."""
CRAWL = 0.15
"""The speed in m/s with which a robot comes into its region. Near a body or a border, a fast one finds no way."""
PLACES = 8
"""The number of other places in the region that are tried if the nearest one is taken."""
ANYWHERE = Circle(0.0, 0.0, 1e5)
"""The field of a game that has none."""


class RefereeDriver:
    """Works out how robots are driven into regions, around bodies and walls.

    Args:
        speeds: the top speed of each player's robot, m/s.
        walls: the ground that walls and obstacles cover, m.
    """

    def __init__(self, speeds: Mapping[str, float], walls: Sequence[Region] = ()) -> None:
        self._speeds = speeds
        self._walls = walls
        self._pilots: dict[str, Pilot] = {}

    def with_twists(
        self, state: RefereeState, driven: Mapping[str, Region], bodies: Mapping[str, Body], now: float
    ) -> RefereeState:
        """The state with the motions of the robots that are driven; the arguments are as for `twists`."""
        if not driven:
            self._pilots = {}
            return state
        field = next((zone.region for zone in state.zones if zone.kind == "field"), None)
        twists = self.twists(driven, state.players, bodies, field, now)
        players = [structs.replace(p, lease=twists[p.name]) if p.name in twists else p for p in state.players]
        return structs.replace(state, players=tuple(players))

    def twists(
        self,
        goals: Mapping[str, Region],
        players: Sequence[PlayerStatus],
        bodies: Mapping[str, Body],
        field: Region | None,
        now: float,
    ) -> dict[str, Twist]:
        """The motion of each player's robot that is driven. A robot stands that the world does not report.

        Args:
            goals: the region into which each player is driven.
            players: all players. bodies: all robots in the world, by name.
            field: what a way should stay in; None if it may lead anywhere.
            now: the match time, s.
        """
        radii = {player.name: player.radius for player in players}
        self._pilots = {name: self._pilots.get(name) or Pilot() for name in goals}
        return {
            name: self._twist(name, goal, radii, bodies, field or ANYWHERE, now)
            if name in bodies and name in radii
            else STILL
            for name, goal in goals.items()
        }

    def _twist(
        self,
        name: str,
        goal: Region,
        radii: Mapping[str, float],
        bodies: Mapping[str, Body],
        field: Region,
        now: float,
    ) -> Twist:
        pose, radius = bodies[name].pose, radii[name]
        neighbours = [
            Obstacle((body.pose.x, body.pose.y), _velocity(body), radius + radii[other])
            for other, body in bodies.items()
            if other != name and other in radii
        ]
        inner, outline = _inner(goal)
        here = (pose.x, pose.y)
        places = [inner.nearest(*here), *sorted(outline, key=lambda place: math.dist(here, place))]
        walls = [(wall, radius + CLEARANCE) for wall in self._walls]
        speed = min(self._speeds[name], max(CRAWL, goal.distance(*here)))
        return self._pilots[name].go(now, pose, places, neighbours, field, speed, walls)


@lru_cache(maxsize=64)
def _inner(goal: Region) -> tuple[Region, list[Vector]]:
    """The part of a region into which robots are driven, and some places in it."""
    inner = goal.shrunk(REGION_DEPTH)
    outline = inner.outline()
    return inner, outline[:: max(1, len(outline) // PLACES)]


def _velocity(body: Body) -> Vector:
    """The velocity of a body in the map's frame, m/s."""
    cos, sin = cos_sin(body.pose.theta)
    return body.twist.v * cos - body.twist.side * sin, body.twist.v * sin + body.twist.side * cos
