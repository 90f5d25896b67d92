"""Pursuers with different gains of eq. 4.4, for pursuit_evasion.py."""

from vrg.games.pursuit_evasion.pursuer import Pursuer


class Bold(Pursuer):
    """It may reach the meeting point at the same time as the intruder."""

    k = 1.0


class Careful(Pursuer):
    """It wants to reach the meeting point in three quarters of the intruder's time."""

    k = 0.75


class Cautious(Pursuer):
    """It wants to reach the meeting point in half of the intruder's time."""

    k = 0.5


BY_GAIN = {kind.k: f"{kind.__module__}.py:{kind.__name__}" for kind in (Bold, Careful, Cautious)}
"""The strategy of a match file for each gain."""
