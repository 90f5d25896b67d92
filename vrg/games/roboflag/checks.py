"""Problems that keep a match of RoboFlag from being played, judged before it begins."""

import math
from collections.abc import Sequence

from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.games.roboflag import TEAMS, other
from vrg.games.roboflag.layout import FieldLayout
from vrg.games.roboflag.settings import Settings
from vrg.regions import touch

ROUNDING = 1e-6
"""The distance in m by which a point of an arc may be outside a border that it touches."""


def problems_of(settings: Settings, contestants: Sequence[Contestant]) -> list[Problem]:
    """Everything that is wrong: an empty team, bodies too large for the distances, a flag or a start misplaced."""
    layout = FieldLayout(settings)
    problems = [
        Problem(f"expected at least one player of the team {team}, got none", ("players",))
        for team in TEAMS
        if all(c.role != team for c in contestants)
    ]
    problems += [Problem(text, ("rules",)) for text in (*_distances(settings, layout, contestants), *_zones(layout))]
    return problems + [
        Problem(why, ("players", c.name)) for c in contestants if (why := _misplaced(layout, c)) is not None
    ]


def _distances(settings: Settings, layout: FieldLayout, contestants: Sequence[Contestant]) -> list[str]:
    """The problems with the distances of the rules."""
    found = []
    longest = {team: max((max(c.size) for c in contestants if c.role == team), default=0.0) for team in TEAMS}
    touching = sum(longest.values()) / 2
    if layout.tag_distance < touching:
        found.append(
            f"two robots touch when their centres are {touching:.2f} m apart, so no player could come within the tag "
            f"distance of {layout.tag_distance:.2f} m: expected a scale of at least "
            f"{math.ceil(100 * touching / settings.tag_distance) / 100:g}, or smaller robots"
        )
    if layout.flag_reach > layout.flag_zone(TEAMS[0]).radius:
        found.append(
            f"expected a flag_zone of at least the flag_reach, {settings.flag_reach:g}, got {settings.flag_zone:g}: "
            "whoever takes a flag must be inside the flag zone"
        )
    return found


def _zones(layout: FieldLayout) -> list[str]:
    """The problems with the places of the zones."""
    found = []
    for team in TEAMS:
        x, y = layout.flag(team)
        zone, home = layout.flag_zone(team), layout.home(team)
        half = layout.half(team)
        room = half.shrunk(-ROUNDING)
        if not all(room.contains(*point) for point in zone.outline()):
            found.append(
                f"expected the flag zone of the team {team} in its half, x {half.x_min:g} to {half.x_max:g}, "
                f"y {half.y_min:g} to {half.y_max:g} m; its flag is at ({x:g}, {y:g}), and the zone has a radius of "
                f"{zone.radius:g} m"
            )
        if math.dist((x, y), (home.x, home.y)) < home.radius + zone.radius:
            found.append(f"expected the flag zone of the team {team} away from its home zone, but they overlap")
        if not all(room.contains(*point) for point in home.outline()):
            found.append(f"expected a home_reach with which the home zone of the team {team} is inside its half")
        elif touch(home, layout.half(other(team))):
            found.append(f"expected a home_reach with which the home zone of the team {team} ends before the midline")
    return found


def _misplaced(layout: FieldLayout, c: Contestant) -> str | None:
    """The reason why a player cannot start where it does, or None."""
    half = layout.half(c.role)
    x, y = c.start.x, c.start.y
    if half.contains(x, y) and (x - layout.midline) * layout.ahead(c.role) < 0.0:
        return None
    return (
        f"expected the start of {c.name} in the half of its team {c.role}, x {half.x_min:g} to {half.x_max:g}, "
        f"y {half.y_min:g} to {half.y_max:g} m, and not on the midline; got ({x:g}, {y:g})"
    )
