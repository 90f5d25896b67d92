"""What a player of RoboFlag sees, in numbers, and the rewards for programs that learn it."""

from collections.abc import Mapping
from typing import Final, NamedTuple

from vrg.agents.strategy import View
from vrg.bus.messages import TIME_LIMIT, PlayerStatus, RefereeState
from vrg.games.roboflag import FLAG_ZONE, FLAGGED, HALF, HOME, NORMAL, RED, TAGGED, TEAMS, flag_of, other
from vrg.regions import Bounds, Region, Sector
from vrg.shared import shared
from vrg.types import Vector
from vrg_learn.learning import Learning, Look, Reward, left

CAPTURES: Final = 3
"""The captures that win by the thesis' rules. The referee publishes no other number, so that of a match file with
another one is not known here."""


class _Field(NamedTuple):
    """What is the same for all players; `flags` and `homes` by team, m."""

    bounds: Bounds
    midline: float
    zones: tuple[Region, ...]
    flags: dict[str, Vector]
    homes: dict[str, Vector]
    carried: dict[str, bool]


def look(view: View) -> Look:
    """What a player sees of the game."""
    me, state = view.me, view.referee
    field = _field(state)
    x, y = view.position
    team, status = me.team, me.state
    opponents = other(team)
    own_half = x <= field.midline if team == RED else x >= field.midline
    home, flag = field.homes[team], field.flags[opponents]

    def flags(player: PlayerStatus) -> tuple[float, ...]:
        its = player.state
        return float(player.team == team), float(its == NORMAL), float(its == TAGGED), float(its == FLAGGED)

    lead = (state.score[team] - state.score[opponents]) / CAPTURES
    numbers = (
        float(status == NORMAL),
        float(status == TAGGED),
        float(status == FLAGGED),
        float(field.carried[team]),
        float(field.carried[opponents]),
        left(state.clock, state.numbers.get(TIME_LIMIT)),
        min(1.0, max(-1.0, lead)),
        float(own_half),
        float(any(zone.contains(x, y) for zone in field.zones)),
    )
    places = flag, field.flags[team], home, (field.midline, y)
    goal = {NORMAL: flag, FLAGGED: home}.get(status)
    return Look(field.bounds, numbers, places, flags, goal)


@shared
def _field(state: RefereeState) -> _Field:
    found = {(zone.kind, zone.team): zone.region for zone in state.zones}
    zones = {team: found[FLAG_ZONE, team] for team in TEAMS}
    carriers = {thing.name: thing.carrier for thing in state.objects}
    return _Field(
        bounds=found["field", None].bounds,
        midline=found[HALF, RED].bounds[2],
        zones=tuple(zones.values()),
        flags={team: zone.middle for team, zone in zones.items()},
        homes={team: _corner(found[HOME, team]) for team in TEAMS},
        carried={team: carriers.get(flag_of(team)) is not None for team in TEAMS},
    )


def _corner(home: Region) -> Vector:
    """The corner of the field in which a home zone is."""
    return (home.x, home.y) if isinstance(home, Sector) else home.middle


REWARDS: Mapping[str, Reward] = {"capture": Reward(team=1.0, rest=-1.0)}
SHAPING: Mapping[str, Reward] = {"tag": Reward(first=-0.1, others=0.1), "flag": Reward(first=0.2)}
"""A call of `tag` names who is tagged, then who tags."""

LEARNING = Learning(
    look=look,
    numbers=(
        "i am normal",
        "i am tagged",
        "i am flagged",
        "own flag is carried",
        "their flag is carried",
        "time left",
        "lead",
        "i am on the own half",
        "i am in a flag zone",
    ),
    places=("their flag's place", "own flag's place", "own home", "nearest point of the midline"),
    flags=("mate", "normal", "tagged", "flagged"),
    states=(NORMAL, TAGGED, FLAGGED),
    rewards=REWARDS,
    shaping=SHAPING,
)
