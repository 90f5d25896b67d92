"""Drives a player's robot: the pilot, with the bodies that the player sees and the obstacles of the map."""

from collections.abc import Mapping, Sequence

from vrg.agents.strategy import View
from vrg.bus.messages import RefereeState
from vrg.navigation.avoidance import Crowd, CrowdBody, Obstacle
from vrg.navigation.pilot import CLEARANCE, OFFSET, Pilot
from vrg.regions import Bounds, Region
from vrg.shared import shared
from vrg.types import Twist, Vector

ABOVE = 0.6
"""The height in m from which on a player is above all that drives."""
LOOK_AHEAD = 4.0
"""The distance in m along x and along y within which bodies are looked at."""


class Mover:
    """Drives one player's robot past the others.

    Args:
        walls: whether it drives around the obstacles of the map, too. A game whose field has none saves the time.
    """

    def __init__(self, *, walls: bool = True) -> None:
        self._pilot = Pilot()
        self._walls = _walls if walls else lambda _: []

    def go(
        self, view: View, place: Vector, bounds: Region, *, ignore: Sequence[str] = (), speed: float | None = None
    ) -> Twist:
        """The twist that drives to a place on the shortest way.

        Args:
            bounds: where the body's centre should be.
            ignore: players that may be touched, such as one that is to be tagged.
            speed: the speed in m/s; the robot's top speed if it is None.
        """
        speed = view.robot.v_max if speed is None else speed
        return self._pilot.go(view.time, view.pose, [place], _near(view, ignore), bounds, speed, self._walls(view))

    def head(
        self, view: View, wanted: Vector, bounds: Region, *, ignore: Sequence[str] = (), offset: float = OFFSET
    ) -> Twist:
        """The twist that drives with a wanted velocity (m/s in the map's frame), past the bodies that are near.

        Args:
            bounds, ignore: as for `go`. offset: as for `Pilot.head`.
        """
        return self._pilot.head(view.time, view.pose, wanted, _near(view, ignore), bounds, self._walls(view), offset)

    def stay(self, view: View, towards: Vector | None = None) -> Twist:
        """The twist of a player that stands, turned towards a place if one is given."""
        return self._pilot.stay(view.time, view.pose, towards)


def _near(view: View, ignore: Sequence[str]) -> list[Obstacle]:
    crowd = _crowd(view.referee, view.velocities, view.pose.z >= ABOVE)
    return crowd.around(view.position, view.me.radius, LOOK_AHEAD, (view.me.name, *ignore))


@shared
def _crowd(state: RefereeState, velocities: Mapping[str, Vector], aloft: bool) -> Crowd:
    """The players whose poses are known, aloft or below; one that may not move has no velocity."""
    return Crowd(
        CrowdBody(
            player.name,
            (player.pose.x, player.pose.y),
            velocities.get(player.name, (0.0, 0.0)) if player.may_move else (0.0, 0.0),
            player.radius,
        )
        for player in state.players
        if player.pose is not None and (player.pose.z >= ABOVE) is aloft
    )


def _walls(view: View) -> list[tuple[Region, float]]:
    """The obstacles of the map that are near, each with the distance to keep from it, m."""
    margin = view.me.radius + CLEARANCE
    x, y = view.position
    reach = LOOK_AHEAD + margin
    return [
        (wall, margin)
        for wall, (x_min, y_min, x_max, y_max) in _boxes(view.obstacles)
        # It is quick to see that most of them are far away.
        if x_min - x < reach and x - x_max < reach and y_min - y < reach and y - y_max < reach
        if wall.distance(x, y) < reach
    ]


@shared
def _boxes(walls: Sequence[Region]) -> list[tuple[Region, Bounds]]:
    """Each of them with its bounds, m."""
    return [(wall, wall.bounds) for wall in walls]
