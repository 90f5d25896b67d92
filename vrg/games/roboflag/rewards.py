"""The rewards of RoboFlag, for programs that learn it."""

from collections.abc import Mapping

from vrg.games.learning import Reward

REWARDS: Mapping[str, Reward] = {"capture": Reward(team=1.0, rest=-1.0)}
SHAPING: Mapping[str, Reward] = {"tag": Reward(first=-0.1, others=0.1), "flag": Reward(first=0.2)}
"""A call of `tag` names who is tagged, then who tags."""
