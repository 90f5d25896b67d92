"""The rewards of Sharks and Minnows, for programs that learn it."""

from collections.abc import Mapping

from vrg.games.learning import Reward

REWARDS: Mapping[str, Reward] = {
    "tag": Reward(first=-1.0, others=1.0),
    "out_of_bounds": Reward(first=-1.0),
    "pass_limit": Reward(first=-1.0),
    "pass_over": Reward(first=1.0, others=1.0),
}
"""A call of `tag` names the minnow, then the sharks; one of `pass_over` names the minnows that are safe."""
