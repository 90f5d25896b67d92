"""What the players see of each other at one tick. In a match in one process it is made once for all of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import PlayerStatus, RefereeState
from vrg.games.sharks_and_minnows import ACTIVE, MINNOW, SHARK
from vrg.navigation.avoidance import Body, Crowd
from vrg.regions import Rectangle, Region
from vrg.shared import shared
from vrg.types import Vector

BORDER: Final = 0.7
"""The distance in m that a body's centre keeps from the border: a little more than it needs to stop."""
_STILL: Final = (0.0, 0.0)
_EVERYWHERE: Final = Rectangle(-1e5, -1e5, 1e5, 1e5)


@dataclass(frozen=True, slots=True)
class Scene:
    """Everybody whose pose is known, and the zones.

    Args:
        field, safe: the field, and the end zone where minnows are safe; None where the referee has not named them.
        bounds: where the centre of a body may be.
        sharks: the active sharks. prey: the active minnows outside the end zone. Both are with their velocities.
        fastest_prey: the speed of the fastest of these, m/s.
        crowd: all bodies; one that may not move has no velocity.
    """

    field: Region | None
    safe: Region | None
    bounds: Region
    sharks: Sequence[Body]
    prey: Sequence[Body]
    fastest_prey: float
    crowd: Crowd


@shared
def scene(state: RefereeState, velocities: Mapping[str, Vector]) -> Scene:
    """What follows from the referee's state and from how fast everybody moves, m/s."""
    zones = {zone.kind: zone.region for zone in reversed(state.zones)}
    field, safe = zones.get("field"), zones.get("safe")
    sharks, prey, bodies = [], [], []
    for player in state.players:
        if player.pose is None:
            continue
        place, velocity = (player.pose.x, player.pose.y), velocities.get(player.name, _STILL)
        body = Body(player.name, place, velocity, player.radius)
        bodies.append(body if player.may_move else Body(player.name, place, _STILL, player.radius))
        if _is_active(player, SHARK):
            sharks.append(body)
        elif _is_active(player, MINNOW) and (safe is None or not safe.contains(*place)):
            prey.append(body)
    bounds = field.shrunk(BORDER) if field else _EVERYWHERE
    fastest = max((math.hypot(*body.velocity) for body in prey), default=0.0)
    return Scene(field, safe, bounds, sharks, prey, fastest, Crowd(bodies))


def _is_active(player: PlayerStatus, role: str) -> bool:
    return player.role == role and player.state == ACTIVE
