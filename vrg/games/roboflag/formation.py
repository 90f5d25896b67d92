"""The formation of attackers before they cross the midline together, as one group or as two (thesis 4.4.3)."""

import math
from collections.abc import Mapping, Sequence

from vrg.games.roboflag.situation import Known, TeamField
from vrg.regions import Bounds
from vrg.types import Vector

FORM_UP_DISTANCE = 0.8
"""The distance in m behind the midline at which attackers form up."""
ATTACKER_SPACING = 1.1
"""The distance in m between two attackers that stand side by side, where there is room."""
IN_PLACE = 0.5
"""The distance in m from its place within which an attacker is in formation."""
FLANK = 1.0
"""The distance in m from the border of the field at which the outer attackers of two groups are."""

FEINT = 0.35
"""The distance in m along the midline by which an attacker in formation drives to either side of its place."""
FEINT_TIME = 4.0
"""The match time in s for which attackers that wait drive to one side, and then to the other."""


def groups(attackers: Sequence[str], flanks: int) -> list[list[str]]:
    """The attackers by group, each sorted by name: every second one is in the other group if there are two."""
    order = sorted(attackers)
    return [order[first::flanks] for first in range(flanks)]


def places(ground: TeamField, attackers: Sequence[str], flanks: int) -> dict[str, Vector]:
    """The places of the attackers in formation: side by side, opposite the flag, or along both borders of the field."""
    _, low, _, high = ground.inner.bounds
    x = ground.midline - ground.ahead * FORM_UP_DISTANCE
    found = {}
    for number, group in enumerate(groups(attackers, flanks)):
        # On a narrow field, or if they are many, they stand closer.
        apart = min(ATTACKER_SPACING, (high - low) / max(1, len(group) - 1))
        width = apart * (len(group) - 1)
        # Both teams count from their own right, so that neither has the better field.
        side = number if ground.ahead > 0 else 1 - number
        middle = ground.their_flag[1] if flanks == 1 else (low + FLANK, high - FLANK)[side % 2]
        middle = min(max(middle, low + width / 2), high - width / 2)
        for place, name in enumerate(group):
            found[name] = (x, middle + ground.ahead * (apart * place - width / 2))
    return found


def formed_up(team: Sequence[Known], formation: Mapping[str, Vector]) -> bool:
    """True if all attackers are in their places."""
    return all(math.dist(known.place, formation[known.name]) <= IN_PLACE for known in team if known.name in formation)


def feint(now: float) -> float:
    """The side to which attackers that wait drive at a match time, s: 1 is their left, -1 their right."""
    return 1.0 if now % (2.0 * FEINT_TIME) < FEINT_TIME else -1.0


def lane(bounds: Bounds, midline: float, ahead: float, now: float) -> Vector:
    """The place behind the midline, m, to which an attacker drives that finds no safe way to the flag.

    So it moves along the line until it is where no defender is.

    Args:
        bounds: where the centre of its body may be, m. midline, ahead: as in `TeamField`. now: the match time, s.
    """
    return midline - ahead * FORM_UP_DISTANCE, bounds[3] - FLANK if ahead * feint(now) > 0.0 else bounds[1] + FLANK
