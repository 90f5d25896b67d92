"""The parts of a field of RoboFlag, and the distances that its rules use, in m (thesis, Figure 4.17).

Also the problems that keep a match on such a field from being played.
"""

import math
from collections.abc import Sequence
from typing import Any

from vrg.bus.messages import Zone
from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.games.roboflag import FLAG_ZONE, HALF, HOME, RED, SCOUTS, TEAMS, other
from vrg.games.roboflag.settings import Settings
from vrg.games.settings import aerial_problems
from vrg.portable.scalars import total
from vrg.regions import Circle, Rectangle, Sector, touch
from vrg.types import Vector

ROUNDING = 1e-6
"""The distance in m by which a point of an arc may be outside a border that it touches."""


class FieldLayout:
    """A field of RoboFlag. All lengths are at the scale of the match.

    Args:
        settings: the [rules] table.

    Attributes:
        field: the whole field.
        midline: the x of the line between the halves, m.
        tag_distance, flag_reach, home_reach: the distances between centres by which the rules judge, m.
    """

    def __init__(self, settings: Settings) -> None:
        scale, (x, y) = settings.scale, settings.centre
        length, width = settings.length * scale, settings.width * scale
        self.midline = x
        self.field = Rectangle(x - length / 2, y - width / 2, x + length / 2, y + width / 2)
        self.tag_distance = settings.tag_distance * scale
        self.flag_reach = settings.flag_reach * scale
        self.home_reach = settings.home_reach * scale
        self._flags = {team: self._place(settings, settings.side(team).flag) for team in TEAMS}
        self._zones = {team: Circle(*self._flags[team], settings.flag_zone * scale) for team in TEAMS}
        self._homes = {team: self._home(team, settings.side(team).home) for team in TEAMS}

    def half(self, team: str) -> Rectangle:
        """The half of a team. The midline belongs to both halves."""
        f = self.field
        if team == RED:
            return Rectangle(f.x_min, f.y_min, self.midline, f.y_max)
        return Rectangle(self.midline, f.y_min, f.x_max, f.y_max)

    def home(self, team: str) -> Sector:
        """The home zone of a team: the quarter circle in a corner of its half."""
        return self._homes[team]

    def flag(self, team: str) -> Vector:
        """The place of a team's flag, which is the centre of its flag zone."""
        return self._flags[team]

    def flag_zone(self, team: str) -> Circle:
        """The zone around a team's flag."""
        return self._zones[team]

    def ahead(self, team: str) -> float:
        """1 if the opponents of a team have the half at greater x, or -1."""
        return 1.0 if team == RED else -1.0

    def flag_zones(self) -> list[Circle]:
        """The zones in which no player can be tagged."""
        return [self._zones[team] for team in TEAMS]

    def numbers(self) -> dict[str, Any]:
        """What `vrg.games.roboflag.judging` takes of a field, by its names; lists have a value for each team."""
        return {
            "flag_places": [self.flag(team) for team in TEAMS],
            "homes": [(home.x, home.y) for home in map(self.home, TEAMS)],
            "ahead": [self.ahead(team) for team in TEAMS],
            "midline": self.midline,
            "tag_distance": self.tag_distance,
            "flag_reach": self.flag_reach,
            "home_reach": self.home_reach,
            "zone": self.flag_zone(RED).radius,
        }

    def zones(self) -> list[Zone]:
        """The parts of the field as they are published."""
        found = [Zone(name="field", kind="field", region=self.field)]
        for team in TEAMS:
            parts = ((HALF, self.half(team)), (HOME, self.home(team)), (FLAG_ZONE, self.flag_zone(team)))
            found += [Zone(name=f"{team} {kind}", kind=kind, region=region, team=team) for kind, region in parts]
        return found

    @staticmethod
    def _place(settings: Settings, offset: Vector) -> Vector:
        return settings.centre[0] + offset[0] * settings.scale, settings.centre[1] + offset[1] * settings.scale

    def _home(self, team: str, end: str) -> Sector:
        f = self.field
        x = f.x_min if team == RED else f.x_max
        y = f.y_min if end == "low" else f.y_max
        quarter = math.pi / 2
        # The direction of the first edge, counter-clockwise: the sector is inside the field.
        start = {(RED, "low"): 0.0, (RED, "high"): -quarter, (other(RED), "low"): quarter}.get((team, end), math.pi)
        return Sector(x, y, self.home_reach, start, quarter)


def problems_of(settings: Settings, contestants: Sequence[Contestant]) -> list[Problem]:
    """Everything that is wrong: an empty team, bodies too large for the distances, a flag or a start misplaced."""
    layout = FieldLayout(settings)
    problems = [
        Problem(f"expected at least one player of the team {team}, got none", ("players",))
        for team in TEAMS
        if all(c.role != team for c in contestants)
    ]
    problems += [Problem(text, ("rules",)) for text in (*_distances(settings, layout, contestants), *_zones(layout))]
    problems += aerial_problems([*SCOUTS.values()], contestants)
    return problems + [
        Problem(why, ("players", c.name)) for c in contestants if (why := _misplaced(layout, c)) is not None
    ]


def _distances(settings: Settings, layout: FieldLayout, contestants: Sequence[Contestant]) -> list[str]:
    """The problems with the distances of the rules."""
    found = []
    longest = {team: max((max(c.size) for c in contestants if c.role == team), default=0.0) for team in TEAMS}
    touching = total(longest.values()) / 2
    if layout.tag_distance < touching:
        found.append(
            f"two robots touch when their centres are {touching:.2f} m apart, so no player could come within the tag "
            f"distance of {layout.tag_distance:.2f} m: expected a scale of at least "
            f"{math.ceil(100 * touching / settings.tag_distance) / 100:g}, or smaller robots"
        )
    if layout.flag_reach > layout.flag_zone(TEAMS[0]).radius:
        found.append(
            f"expected a flag_zone of at least the flag_reach, {settings.flag_reach:g}, got {settings.flag_zone:g}: "
            "a player that takes a flag must be inside the flag zone"
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
    team = c.team or c.role
    half = layout.half(team)
    x, y = c.start.x, c.start.y
    if half.contains(x, y) and (x - layout.midline) * layout.ahead(team) < 0.0:
        return None
    return (
        f"expected the start of {c.name} in the half of its team {team}, x {half.x_min:g} to {half.x_max:g}, "
        f"y {half.y_min:g} to {half.y_max:g} m, and not on the midline; got ({x:g}, {y:g})"
    )
