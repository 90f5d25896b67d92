"""What keeps a match of pursuit-evasion from being played, judged before it begins."""

import math
from collections.abc import Sequence

from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.games.pursuit_evasion import INTRUDER, PURSUER
from vrg.regions import Region

FAR = 1e4
"""The length in m of the way along which an intruder's course is looked at."""


def problems_of(area: Region, contestants: Sequence[Contestant]) -> list[Problem]:
    """Everything that is wrong: a role that nobody has, or an intruder that cannot cross the area."""
    problems = [
        Problem(f"expected at least one {role}, got none", ("players",))
        for role in (PURSUER, INTRUDER)
        if all(c.role != role for c in contestants)
    ]
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
    end = (x + FAR * math.cos(c.start.theta), y + FAR * math.sin(c.start.theta))
    stretch = area.inside((x, y), end)
    if stretch is None or stretch[1] <= stretch[0]:
        heading = math.degrees(c.start.theta)
        return (
            f"{c.name} drives straight on from ({x:g}, {y:g}) with heading {heading:g} degrees and never comes into "
            "the surveillance area: turn it, or move it or the area"
        )
    return None
