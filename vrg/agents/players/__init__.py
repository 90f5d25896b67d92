"""The strategies that come with VRG, one file a game."""

_STRATEGIES = {"sharks-and-minnows": "vrg.agents.players.sharks_and_minnows:SharksAndMinnowsPlayer"}


def default_strategy(game: str) -> str:
    """`module:Class` of the strategy that plays a game where the match file names no other."""
    return _STRATEGIES[game]
