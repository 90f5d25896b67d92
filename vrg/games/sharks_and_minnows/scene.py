"""What the players see of each other at one tick. In a match in one process it is made once for all of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import PlayerStatus, RefereeState
from vrg.games.sharks_and_minnows import ACTIVE, MINNOW, SHARK
from vrg.games.sharks_and_minnows.lineup import Extent, in_order
from vrg.navigation.avoidance import Body, Crowd
from vrg.regions import Rectangle, Region
from vrg.shared import shared
from vrg.types import Pose, Vector

BORDER: Final = 0.7
"""The distance in m that a body's centre keeps from the border: a little more than it needs to stop."""
_STILL: Final = (0.0, 0.0)
_EVERYWHERE: Final = Rectangle(-1e5, -1e5, 1e5, 1e5)


@dataclass(frozen=True, slots=True)
class Scene:
    """Everybody whose pose is known, and the zones.

    Args:
        field, safe, start: the field, the end zone where minnows are safe, and the one where they start; None where the
            referee has not named them.
        bounds: where the centre of a body may be.
        sharks: the active sharks. prey: the active minnows outside the end zone. Both are with their velocities.
        nearest_to: the prey to which each shark is the nearest one, by the shark's name.
        fastest_prey: the speed of the fastest of these, m/s.
        berths: the place in the safe zone to which each active minnow crosses, m.
        crowd: all bodies; one that may not move has no velocity.
    """

    field: Region | None
    safe: Region | None
    start: Region | None
    bounds: Region
    sharks: Sequence[Body]
    prey: Sequence[Body]
    nearest_to: Mapping[str, Sequence[Body]]
    fastest_prey: float
    berths: Mapping[str, Vector]
    crowd: Crowd


@shared
def scene(state: RefereeState, velocities: Mapping[str, Vector]) -> Scene:
    """What follows from the referee's state and from how fast everybody moves, m/s."""
    zones = {zone.kind: zone.region for zone in reversed(state.zones)}
    field, safe, start = zones.get("field"), zones.get("safe"), zones.get("start")
    sharks, prey, bodies = [], [], []
    minnows: dict[str, Pose] = {}
    for player in state.players:
        if player.pose is None:
            continue
        place, velocity = (player.pose.x, player.pose.y), velocities.get(player.name, _STILL)
        body = Body(player.name, place, velocity, player.radius)
        bodies.append(body if player.may_move else Body(player.name, place, _STILL, player.radius))
        if _is_active(player, SHARK):
            sharks.append(body)
        elif _is_active(player, MINNOW):
            minnows[player.name] = player.pose
            if safe is None or not safe.contains(*place):
                prey.append(body)
    bounds = field.shrunk(BORDER) if field else _EVERYWHERE
    fastest = max((math.hypot(*body.velocity) for body in prey), default=0.0)
    nearest_to: dict[str, list[Body]] = {}
    for minnow in prey if sharks else ():
        nearest = min(sharks, key=lambda shark: math.dist(shark.position, minnow.position))
        nearest_to.setdefault(nearest.name, []).append(minnow)
    berths = _berths(minnows, field, safe, 2 * max((body.radius for body in bodies), default=0.0))
    return Scene(field, safe, start, bounds, sharks, prey, nearest_to, fastest, berths, Crowd(bodies))


def _berths(minnows: Mapping[str, Pose], field: Region | None, safe: Region | None, width: float) -> dict[str, Vector]:
    """Places side by side in the safe zone, so that minnows cross on different lanes and leave room for one another."""
    if not (isinstance(field, Rectangle) and isinstance(safe, Rectangle)):
        return {}
    marks = in_order(minnows, safe, field, Extent(width, width))
    return {name: (mark.x, mark.y) for name, mark in marks.items()}


def _is_active(player: PlayerStatus, role: str) -> bool:
    return player.role == role and player.state == ACTIVE
