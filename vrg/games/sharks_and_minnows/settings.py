"""The [rules] table of a match of Sharks and Minnows, and the problems that keep a match from being played."""

from collections.abc import Sequence
from typing import Literal

from pydantic import Field as Setting
from pydantic import model_validator

from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.games.settings import Borders, LineUp, none_of
from vrg.games.sharks_and_minnows import MINNOW, SHARK
from vrg.games.sharks_and_minnows.lineup import LargestBody, crowded
from vrg.regions import Rectangle


class Settings(Borders, LineUp):
    """The [rules] table of a match file, with those of `Borders` and `LineUp`. Lengths in m, times in s.

    Args:
        along: the axis along which minnows cross.
        first_goal: the end that the minnows cross to in the first pass, where the sharks line up.
        zone_depth: the depth of the end zones.
        tag_distance: the distance of the outlines of a shark and a minnow at which the minnow is tagged.
        passes: the number of passes. The default is the rule's floor((minnows - sharks) / 2); this is an extension.
        pass_limit: the time after which minnows outside the end zone become inactive; 0 means no limit. The default is
            three times what the slowest player may need for the length of the field; this is an extension.
        slowest: each player's top speed is drawn between this fraction of its model's and the whole.
    """

    along: Literal["x", "y"] = "y"
    first_goal: Literal["low", "high"] = "low"
    zone_depth: float = Setting(3.0, gt=0)
    tag_distance: float = Setting(0.30, gt=0)
    passes: int | None = Setting(None, ge=1)
    pass_limit: float | None = Setting(None, ge=0)
    slowest: float = Setting(0.6, gt=0, le=1)

    @model_validator(mode="after")
    def _playable(self) -> "Settings":
        if self.length <= 2 * self.zone_depth:
            raise ValueError(
                f"zone_depth: two end zones of {self.zone_depth} m do not fit into a field {self.length:g} m long"
            )
        return self

    @property
    def length(self) -> float:
        """The length of the field in the direction in which minnows cross, m."""
        low, high = self.x if self.along == "x" else self.y
        return high - low

    def end_zone(self, end: str) -> Rectangle:
        """The end zone at the `low` or `high` end."""
        f, depth = self.field, self.zone_depth
        if self.along == "x":
            if end == "low":
                return Rectangle(f.x_min, f.y_min, f.x_min + depth, f.y_max)
            return Rectangle(f.x_max - depth, f.y_min, f.x_max, f.y_max)
        if end == "low":
            return Rectangle(f.x_min, f.y_min, f.x_max, f.y_min + depth)
        return Rectangle(f.x_min, f.y_max - depth, f.x_max, f.y_max)


def opposite(end: str) -> str:
    """The other end of the field."""
    return "high" if end == "low" else "low"


def passes(contestants: Sequence[Contestant]) -> int:
    """The number of passes by the rule: half of what there are more minnows than sharks, rounded down."""
    minnows, sharks = (sum(c.role == role for c in contestants) for role in (MINNOW, SHARK))
    return (minnows - sharks) // 2


def problems_of(settings: Settings, contestants: Sequence[Contestant], extent: LargestBody) -> list[Problem]:
    """Everything that is wrong: too few players for a pass, no room to line up, or a start at the wrong place."""
    minnows, sharks = (sum(c.role == role for c in contestants) for role in (MINNOW, SHARK))
    problems: list[Problem] = []
    if settings.passes is None and passes(contestants) < 1:
        text = (
            f"expected at least two minnows more than sharks, got minnows: {minnows}, sharks: {sharks}; the number of "
            f"passes is floor((minnows - sharks) / 2) = {passes(contestants)}, unless `passes` in [rules] sets it"
        )
        problems.append(Problem(text, ("players",)))
    else:
        problems += none_of([MINNOW], contestants)
    problems += none_of([SHARK], contestants)
    ends = [settings.end_zone(end) for end in ("low", "high")]
    if any(crowded(len(contestants), zone, settings.field, extent) for zone in ends):
        text = (
            f"expected end zones in which {len(contestants)} robots can line up without touching one another: make "
            "zone_depth or the field larger, or play with fewer"
        )
        problems.append(Problem(text, ("rules",)))
    return problems + [
        Problem(why, ("players", c.name)) for c in contestants if (why := _misplaced(settings, c)) is not None
    ]


def _misplaced(settings: Settings, c: Contestant) -> str | None:
    """The reason why a player cannot start where it does, or None."""
    if not settings.field.contains(c.start.x, c.start.y):
        return f"{c.name} starts at ({c.start.x:g}, {c.start.y:g}), out of bounds"
    end = settings.first_goal if c.role == SHARK else opposite(settings.first_goal)
    zone = settings.end_zone(end)
    if zone.contains(c.start.x, c.start.y):
        return None
    return (
        f"{c.name} is a {c.role} and starts in the zone x {zone.x_min:g} to {zone.x_max:g}, "
        f"y {zone.y_min:g} to {zone.y_max:g}; ({c.start.x:g}, {c.start.y:g}) is outside it"
    )
