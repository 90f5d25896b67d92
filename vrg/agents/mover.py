"""Drives a player's robot: the pilot, with the bodies that the player sees and the obstacles of the map."""

from collections.abc import Sequence

from vrg.agents.strategy import View
from vrg.navigation.avoidance import Obstacle
from vrg.navigation.pilot import CLEARANCE, Pilot
from vrg.regions import Region
from vrg.types import Twist, Vector

LOOK_AHEAD = 4.0
"""The distance in m along x and along y within which bodies are looked at."""


class Mover:
    """Drives one player's robot past the others."""

    def __init__(self) -> None:
        self._pilot = Pilot()

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
        return self._pilot.go(view.time, view.pose, [place], _near(view, ignore), bounds, speed, _walls(view))

    def head(self, view: View, wanted: Vector, bounds: Region, *, ignore: Sequence[str] = ()) -> Twist:
        """The twist that drives with a wanted velocity (m/s in the map's frame), past the bodies that are near."""
        return self._pilot.head(view.time, view.pose, wanted, _near(view, ignore), bounds, _walls(view))

    def stay(self, view: View, towards: Vector | None = None) -> Twist:
        """The twist of a player that stands, turned towards a place if one is given."""
        return self._pilot.stay(view.time, view.pose, towards)


def _near(view: View, ignore: Sequence[str]) -> list[Obstacle]:
    x, y = view.position
    me, radius = view.me.name, view.me.radius
    found = []
    for other in view.referee.players:
        pose = other.pose
        if pose is None or other.name == me or other.name in ignore:
            continue
        if abs(pose.x - x) < LOOK_AHEAD and abs(pose.y - y) < LOOK_AHEAD:
            velocity = view.velocities.get(other.name, (0.0, 0.0)) if other.may_move else (0.0, 0.0)
            found.append(Obstacle((pose.x, pose.y), velocity, radius + other.radius))
    return found


def _walls(view: View) -> list[tuple[Region, float]]:
    """The obstacles of the map that are near, each with the distance to keep from it, m."""
    margin = view.me.radius + CLEARANCE
    return [(wall, margin) for wall in view.obstacles if wall.distance(*view.position) < LOOK_AHEAD + margin]
