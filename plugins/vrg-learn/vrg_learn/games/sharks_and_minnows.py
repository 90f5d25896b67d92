"""What a player of Sharks and Minnows sees, in numbers, and the rewards for programs that learn it."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from vrg.agents.strategy import View
from vrg.bus.messages import TIME_LIMIT, PlayerStatus, RefereeState
from vrg.games.sharks_and_minnows import ACTIVE, INACTIVE, MINNOW, SHARK, SHARKS
from vrg.regions import Bounds, Region
from vrg.shared import shared
from vrg.types import Vector
from vrg_learn.learning import Learning, Look, Reward, left


class _Pass(NamedTuple):
    """What is the same for all players.

    Args:
        minnows: the places of the active minnows, m. shares: those of all players that are active minnows, and sharks.
    """

    bounds: Bounds
    safe: Region
    middle: Vector
    minnows: tuple[Vector, ...]
    shares: tuple[float, float]


def look(view: View) -> Look:
    """What a player sees of the game."""
    me, state = view.me, view.referee
    here = _pass(state)
    safe, (x, y), role = here.safe, view.position, me.role
    shark, active, at_home = role == SHARK, me.state == ACTIVE, safe.contains(x, y)
    nearest = safe.nearest(x, y)

    def flags(other: PlayerStatus) -> tuple[float, ...]:
        pose = other.pose
        inside = pose is not None and safe.contains(pose.x, pose.y)
        return float(other.role == role), float(other.team == me.team), float(other.state == ACTIVE), float(inside)

    goal = None
    if active:
        goal = min(here.minnows, key=lambda place: math.dist(place, (x, y)), default=None) if shark else nearest
    numbers = (
        float(shark),
        float(active),
        float(at_home),
        left(state.clock, state.numbers.get(TIME_LIMIT)),
        min(1.0, state.round / max(1, state.rounds)),
        *here.shares,
        float(me.team == SHARKS),
    )
    return Look(here.bounds, numbers, (nearest, here.middle), flags, goal)


@shared
def _pass(state: RefereeState) -> _Pass:
    zones = {zone.kind: zone.region for zone in state.zones}
    active = [player for player in state.players if player.state == ACTIVE]
    minnows = [player for player in active if player.role == MINNOW]
    count = len(state.players)
    return _Pass(
        bounds=zones["field"].bounds,
        safe=zones["safe"],
        middle=zones["safe"].middle,
        minnows=tuple((player.pose.x, player.pose.y) for player in minnows if player.pose is not None),
        shares=(len(minnows) / count, (len(active) - len(minnows)) / count),
    )


REWARDS: Mapping[str, Reward] = {
    "tag": Reward(first=-1.0, others=1.0),
    "out_of_bounds": Reward(first=-1.0),
    "pass_limit": Reward(first=-1.0),
    "pass_over": Reward(first=1.0, others=1.0),
}
"""A call of `tag` names the minnow, then the sharks; one of `pass_over` names the minnows that are safe."""

LEARNING = Learning(
    look=look,
    numbers=(
        "i am a shark",
        "i am active",
        "i am in the safe zone",
        "time left",
        "round",
        "active minnows",
        "active sharks",
        "i began as a shark",
    ),
    places=("nearest point of the safe zone", "centre of the safe zone"),
    flags=("same role", "same team", "active", "in the safe zone"),
    states=(ACTIVE, INACTIVE),
    rewards=REWARDS,
)
