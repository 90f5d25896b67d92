"""The parts of a field of RoboFlag, and the distances that its rules use, in m (thesis, Figure 4.17)."""

import math

from vrg.bus.messages import Zone
from vrg.games.roboflag import FLAG_ZONE, HALF, HOME, RED, TEAMS, other
from vrg.games.roboflag.settings import Settings
from vrg.regions import Circle, Rectangle, Sector
from vrg.types import Vector


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
