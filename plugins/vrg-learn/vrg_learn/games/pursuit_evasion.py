"""What a player of pursuit-evasion sees, in numbers, and the rewards for programs that learn it.

Poses of others are unknown while they are in play.
"""

from collections.abc import Mapping

from vrg.agents.strategy import View
from vrg.bus.messages import TIME_LIMIT, PlayerStatus, RefereeState
from vrg.games.pursuit_evasion import (
    AREA,
    CAPTURED,
    CROSSING,
    DISPATCHED,
    ESCAPED,
    OUT,
    PURSUER,
    RETURNING,
    WAITING,
    WATCHING,
)
from vrg.regions import Bounds, Region
from vrg.shared import shared
from vrg.types import Vector
from vrg_learn.learning import Learning, Look, Reward, left


def look(view: View) -> Look:
    """What a player sees of the game. It is in play while its robot may be driven."""
    me, state = view.me, view.referee
    bounds, area, middle = _area(state)
    team = me.team

    def flags(other: PlayerStatus) -> tuple[float, ...]:
        return (float(other.team == team),)

    numbers = float(me.role == PURSUER), float(me.may_move), left(state.clock, state.numbers.get(TIME_LIMIT))
    return Look(bounds, numbers, (middle, area.nearest(*view.position)), flags)


@shared
def _area(state: RefereeState) -> tuple[Bounds, Region, Vector]:
    area = next(zone.region for zone in state.zones if zone.kind == AREA)
    return area.bounds, area, area.middle


_CAPTURED = Reward(team=-1.0, rest=1.0)
REWARDS: Mapping[str, Reward] = {
    "capture": _CAPTURED,
    "off_course": _CAPTURED,
    "slow": _CAPTURED,
    "escape": Reward(team=1.0, rest=-1.0),
}
"""All of these calls name the intruder first. One that leaves its course or is slow counts as captured."""

LEARNING = Learning(
    look=look,
    numbers=("i am a pursuer", "i am in play", "time left"),
    places=("centre of the area", "nearest point of the area"),
    flags=("mate",),
    states=(WATCHING, DISPATCHED, RETURNING, WAITING, CROSSING, CAPTURED, ESCAPED, OUT),
    scan=True,
    talks=True,
    rewards=REWARDS,
)
