"""Problems that keep a match of pursuit-evasion from being played, judged before it begins."""

import math
from collections.abc import Sequence

from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.games.pursuit_evasion import INTRUDER, PURSUER
from vrg.regions import Region


def problems_of(area: Region, contestants: Sequence[Contestant], capture_distance: float) -> list[Problem]:
    """Everything that is wrong: a role without a player, or an intruder that cannot cross or is captured at once."""
    problems = [
        Problem(f"expected at least one {role}, got none", ("players",))
        for role in (PURSUER, INTRUDER)
        if all(c.role != role for c in contestants)
    ]
    for intruder in (c for c in contestants if c.role == INTRUDER):
        for pursuer in (c for c in contestants if c.role == PURSUER):
            between = math.dist((intruder.start.x, intruder.start.y), (pursuer.start.x, pursuer.start.y))
            if between < capture_distance:
                text = f"{intruder.name} starts {between:.2f} m from {pursuer.name}, which captures it at once"
                problems.append(Problem(text, ("players", intruder.name)))
    return problems + [
        Problem(why, ("players", c.name))
        for c in contestants
        if c.role == INTRUDER and (why := _cannot_cross(area, c)) is not None
    ]


def _cannot_cross(area: Region, c: Contestant) -> str | None:
    """The reason why an intruder cannot cross the area, or None."""
    x, y = c.start.x, c.start.y
    if area.contains(x, y):
        return f"{c.name} is an intruder and starts outside the surveillance area; ({x:g}, {y:g}) is inside"
    # Beyond the farthest corner there is nothing of the area any more.
    far = 1.0 + max(math.dist((x, y), corner) for corner in area.outline())
    end = (x + far * math.cos(c.start.theta), y + far * math.sin(c.start.theta))
    stretch = area.inside((x, y), end)
    if stretch is None or stretch[1] <= stretch[0]:
        heading = math.degrees(c.start.theta)
        return (
            f"{c.name} drives straight on from ({x:g}, {y:g}) with heading {heading:g} degrees and never comes into "
            "the surveillance area: turn it, or move it or the area"
        )
    return None
