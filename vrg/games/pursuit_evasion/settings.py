"""The [rules] table of a match of pursuit-evasion, and the problems that keep a match from being played."""

import math
from collections.abc import Sequence
from typing import Annotated

from pydantic import Field as Setting
from pydantic import field_validator, model_validator

from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.games.pursuit_evasion import INTRUDER, PURSUER, SCOUT
from vrg.games.settings import Coordinate, LineUp, aerial_problems, none_of
from vrg.geometry import ahead
from vrg.portable.scalars import square
from vrg.regions import Polygon, Region
from vrg.segments import area, convex, cross, turned
from vrg.types import Vector


class Settings(LineUp):
    """The [rules] table of a match file, with that of `LineUp`. Lengths in m, times in s, speeds in m/s.

    Args:
        area: the corners (x, y) of the convex surveillance area, in order around it.
        capture_distance: an intruder is captured when its centre is closer than this to that of a pursuer.
        launch_window: the first intruder starts at 0 s, and each other one at a random time up to this one.
        time: the time after which the game ends in any case.
        auction: how long an auction lasts at least.
        lost_after: an intruder that no pursuer has seen for so long is lost, and is auctioned again.
        pursuer_speed, intruder_speed: the top speeds of the two teams. The default is the same for both: the top speed
            of the slowest robot.
    """

    area: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Setting(min_length=3, max_length=100)]
    capture_distance: float = Setting(1.0, gt=0, le=100)
    launch_window: float = Setting(20.0, ge=0, le=1e6)
    time: float = Setting(120.0, gt=0, le=1e6)
    auction: float = Setting(0.5, ge=0.1, le=1e3)
    lost_after: float = Setting(4.0, gt=0, le=1e6)
    pursuer_speed: float | None = Setting(None, gt=0, le=100)
    intruder_speed: float | None = Setting(None, gt=0, le=100)

    @field_validator("area")
    @classmethod
    def _convex(cls, corners: tuple[Vector, ...]) -> tuple[Vector, ...]:
        why = not_convex(corners)
        if why is not None:
            raise ValueError(why)
        return corners if area(corners) > 0.0 else corners[::-1]

    @model_validator(mode="after")
    def _everybody_starts(self) -> "Settings":
        if self.launch_window >= self.time:
            raise ValueError(
                f"launch_window: expected less than the time of the game, {self.time:g} s, got {self.launch_window:g}"
            )
        return self

    @property
    def region(self) -> Polygon:
        """The surveillance area."""
        return Polygon(self.area)


def not_convex(corners: Sequence[Vector]) -> str | None:
    """The reason why corners, in order either way round, are not those of a convex polygon; None if they are."""
    for i, (x, y) in enumerate(corners):
        if (x, y) == corners[i - 1]:
            return f"corner {i + 1}, ({x:g}, {y:g}), is the same as the one before it"
    side = math.copysign(1.0, area(corners))
    if convex(corners if side > 0.0 else corners[::-1]):
        return None
    turns = [side * cross(a, b, c) for a, b, c in zip(turned(corners, -1), corners, turned(corners), strict=True)]
    tiny = 1e-9 * square(max(math.dist(a, b) for a in corners for b in corners))
    if max(map(abs, turns)) <= tiny:
        return "expected an area, but all corners are on one line"
    if min(turns) >= -1e-9 or _crosses(corners):
        return "expected a convex polygon, but its border crosses itself: name the corners in order around it"
    i = turns.index(min(turns))
    x, y = corners[i]
    return f"expected a convex polygon, but at corner {i + 1}, ({x:g}, {y:g}), the border bends inwards"


def _crosses(corners: Sequence[Vector]) -> bool:
    """True if two sides that are not neighbours cross."""
    count = len(corners)
    sides = [(corners[i], corners[(i + 1) % count]) for i in range(count)]
    return any(
        cross(*sides[i], a) * cross(*sides[i], b) < 0.0 and cross(a, b, sides[i][0]) * cross(a, b, sides[i][1]) < 0.0
        for i in range(count)
        for a, b in sides[i + 2 :]
    )


def problems_of(area: Region, contestants: Sequence[Contestant], capture_distance: float) -> list[Problem]:
    """Everything that is wrong: a role without a player, or an intruder that cannot cross or is captured at once."""
    problems = none_of((PURSUER, INTRUDER), contestants)
    problems += aerial_problems([SCOUT], contestants)
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
    end = ahead(x, y, c.start.theta, far)
    stretch = area.inside((x, y), end)
    if stretch is None or stretch[1] <= stretch[0]:
        heading = math.degrees(c.start.theta)
        return (
            f"{c.name} drives straight on from ({x:g}, {y:g}) with heading {heading:g} degrees and never comes into "
            "the surveillance area: turn it, or move it or the area"
        )
    return None
