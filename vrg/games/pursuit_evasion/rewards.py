"""The rewards of pursuit-evasion, for programs that learn it."""

from collections.abc import Mapping

from vrg.games.learning import Reward

_CAPTURED = Reward(team=-1.0, rest=1.0)
REWARDS: Mapping[str, Reward] = {
    "capture": _CAPTURED,
    "off_course": _CAPTURED,
    "slow": _CAPTURED,
    "escape": Reward(team=1.0, rest=-1.0),
}
"""All of these calls name the intruder first. One that leaves its course or is slow counts as captured."""
