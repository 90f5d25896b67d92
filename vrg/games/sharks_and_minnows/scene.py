"""The players' view of each other at one tick. In a match in one process it is made once for all of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from vrg.agents.interception import intercept
from vrg.bus.messages import PlayerStatus, RefereeState
from vrg.games.sharks_and_minnows import ACTIVE, MINNOW, SHARK
from vrg.games.sharks_and_minnows.lineup import LargestBody, in_order
from vrg.navigation.avoidance import CrowdBody
from vrg.regions import Rectangle, Region
from vrg.shared import shared
from vrg.types import Pose, Vector, quantised

BORDER_CLEARANCE: Final = 0.7
"""The distance in m that a body's centre keeps from the border: a little more than it needs to stop."""
ASSUMED_SPEED: Final = 0.7
"""The speed in m/s that every shark is taken to have when the minnows are shared out, as no player knows another's."""
URGENCY: Final = 2.0
"""The seconds by which each metre that a minnow is nearer to the safe zone makes up for a later meeting, s/m."""
UNMET: Final = 1e3
"""The time in s, and more by the distance, at which a minnow that cannot be met counts as met."""
_STILL: Final = (0.0, 0.0)
_EVERYWHERE: Final = Rectangle(-1e5, -1e5, 1e5, 1e5)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Everybody whose pose is known, and the zones.

    Args:
        field, safe, start: the field, the end zone where minnows are safe, and the one where they start; None where the
            referee has not named them.
        bounds: where the centre of a body may be.
        sharks: the active sharks. prey: the active minnows outside the end zone. Both are with their velocities.
        prey_of: the minnow that each shark chases, by the shark's name.
        berths: the place in the safe zone to which each active minnow crosses, m.
    """

    field: Region | None
    safe: Region | None
    start: Region | None
    bounds: Region
    sharks: Sequence[CrowdBody]
    prey: Sequence[CrowdBody]
    prey_of: Mapping[str, CrowdBody]
    berths: Mapping[str, Vector]


@shared
def scene(state: RefereeState, velocities: Mapping[str, Vector]) -> Surroundings:
    """The surroundings by the referee's state and the players' velocities, m/s."""
    zones = {zone.kind: zone.region for zone in reversed(state.zones)}
    field, safe, start = zones.get("field"), zones.get("safe"), zones.get("start")
    sharks, prey = [], []
    widest = max((player.radius for player in state.players if player.pose is not None), default=0.0)
    minnows: dict[str, Pose] = {}
    for player in state.players:
        if player.pose is None:
            continue
        place, velocity = (player.pose.x, player.pose.y), velocities.get(player.name, _STILL)
        body = CrowdBody(player.name, place, velocity, player.radius)
        if _is_active(player, SHARK):
            sharks.append(body)
        elif _is_active(player, MINNOW):
            minnows[player.name] = player.pose
            if safe is None or not safe.contains(*place):
                prey.append(body)
    bounds = field.shrunk(BORDER_CLEARANCE) if field else _EVERYWHERE
    berths = _berths(minnows, field, safe, 2 * widest)
    return Surroundings(field, safe, start, bounds, sharks, prey, _prey_of(sharks, prey, safe), berths)


def _prey_of(sharks: Sequence[CrowdBody], prey: Sequence[CrowdBody], safe: Region | None) -> dict[str, CrowdBody]:
    """The minnow of each shark: the pairs that cost least come first. Two share one only if too few are left."""
    left = [0.0 if safe is None else math.dist(minnow.position, safe.nearest(*minnow.position)) for minnow in prey]
    pairs = sorted(
        (quantised(_cost(shark, minnow, safe, left[i])), shark.name, i)
        for shark in sharks
        for i, minnow in enumerate(prey)
    )
    chased: dict[str, int] = {}
    taken: set[int] = set()
    for _, shark, i in pairs:
        if shark not in chased and i not in taken:
            chased[shark] = i
            taken.add(i)
    for _, shark, i in pairs:
        chased.setdefault(shark, i)
    return {shark: prey[i] for shark, i in chased.items()}


def _cost(shark: CrowdBody, minnow: CrowdBody, safe: Region | None, left: float) -> float:
    """The time in s at which a shark can meet a minnow, and more the farther the minnow is from the safe zone.

    So a shark leaves a minnow that it has chased back for one that is about to pass. The cost is greater than any other
    where they cannot meet before the minnow is safe.

    Args:
        left: the way from the minnow to the safe zone, m.
    """
    met = intercept(shark.position, ASSUMED_SPEED, minnow.position, minnow.velocity, reach=shark.radius + minnow.radius)
    if met is None or (safe is not None and safe.contains(*met.point)):
        return UNMET + math.dist(shark.position, minnow.position) + URGENCY * left
    return met.time + URGENCY * left


def _berths(minnows: Mapping[str, Pose], field: Region | None, safe: Region | None, width: float) -> dict[str, Vector]:
    """Places side by side in the safe zone, so that minnows cross on different lanes and leave room for one another."""
    # After a restart of the referee its state may have no poses yet.
    if not (minnows and isinstance(field, Rectangle) and isinstance(safe, Rectangle)):
        return {}
    marks = in_order(minnows, safe, field, LargestBody(width, width))
    return {name: (mark.x, mark.y) for name, mark in marks.items()}


def _is_active(player: PlayerStatus, role: str) -> bool:
    return player.role == role and player.state == ACTIVE
