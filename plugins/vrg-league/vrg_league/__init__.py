"""The comparison of strategies: many games in pairs with the sides swapped, and what they prove.

import vrg_league

found = vrg_league.compare("mine.py", "balanced", match="roboflag")
found.plot()
"""

from typing import TYPE_CHECKING, Any, Final

from vrg.plugins import Command

if TYPE_CHECKING:
    from vrg_league.api import compare

__all__ = ["COMPARE", "LEAGUE", "TOURNAMENT", "compare"]

COMPARE: Final = Command(
    ("compare",), "Compare", "Find out which of two strategies is better", "vrg_league.compare_command:compare"
)
"""The command `vrg compare`."""

TOURNAMENT: Final = Command(
    ("tournament",),
    "Compare",
    "Let every strategy play against every other one",
    "vrg_league.compare_command:tournament",
)
"""The command `vrg tournament`."""

LEAGUE: Final = Command(
    ("league",),
    "Compare",
    "Run an ongoing tournament of players that may change: play, check",
    "vrg_league.league_command:app",
)
"""The commands below `vrg league`."""


def __getattr__(name: str) -> Any:
    if name == "compare":
        # Help pages import this package; what plays games takes a second to load.
        from vrg.registry import load_object  # noqa: PLC0415

        return load_object("vrg_league.api:compare")
    raise AttributeError(f"module 'vrg_league' has no attribute {name!r}")
