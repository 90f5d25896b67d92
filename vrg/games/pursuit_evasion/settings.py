"""The [rules] table of a match of pursuit-evasion."""

import math
from collections.abc import Sequence
from typing import Annotated

from pydantic import Field as Setting
from pydantic import field_validator, model_validator

from vrg.games.settings import Coordinate, LineUp
from vrg.geometry import wrap
from vrg.regions import Polygon
from vrg.segments import cross
from vrg.types import Vector

CROSSES = "expected a convex polygon, but its border crosses itself: name the corners in order around it"


class Settings(LineUp):
    """The [rules] table of a match file, with that of `LineUp`. Lengths in m, times in s, speeds in m/s.

    Args:
        area: the corners (x, y) of the convex surveillance area, in order around it.
        capture_distance: an intruder is captured when its centre is closer than this to that of a pursuer.
        launch_window: the first intruder starts at 0 s, and each other one at a random time up to this one.
        time: the time after which the game ends in any case.
        auction: how long an auction lasts at least.
        lost_after: an intruder that nobody has seen for so long is lost, and is auctioned again.
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
        return corners if _turning(corners) > 0 else tuple(reversed(corners))

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
    """The reason why corners, in order, are not those of a convex polygon; None if they are.

    All turns of a convex polygon lead to the same side, and together they make one full turn.
    """
    count = len(corners)
    for i, (x, y) in enumerate(corners):
        if (x, y) == corners[i - 1]:
            return f"corner {i + 1}, ({x:g}, {y:g}), is the same as the one before it"
    tiny = 1e-9 * max(math.dist(a, b) for a in corners for b in corners) ** 2
    if all(abs(cross(corners[i - 2], corners[i - 1], corner)) <= tiny for i, corner in enumerate(corners)):
        return "expected an area, but all corners are on one line"
    turns = _turns(corners)
    left, right = [i for i in range(count) if turns[i] > 1e-9], [i for i in range(count) if turns[i] < -1e-9]
    if abs(abs(sum(turns)) - math.tau) > 1e-6:
        return CROSSES
    if left and right:
        i = min(left, right, key=len)[0]
        x, y = corners[i]
        inwards = f"expected a convex polygon, but at corner {i + 1}, ({x:g}, {y:g}), the border bends inwards"
        return CROSSES if _crosses(corners) else inwards
    try:
        Polygon(tuple(corners if left else reversed(corners)))
    except ValueError:
        return "expected a convex polygon, but at a corner between straight sides the border bends inwards a little"
    return None


def _crosses(corners: Sequence[Vector]) -> bool:
    """Whether two sides that are not neighbours cross."""
    count = len(corners)
    sides = [(corners[i], corners[(i + 1) % count]) for i in range(count)]
    return any(
        cross(*sides[i], a) * cross(*sides[i], b) < 0.0 and cross(a, b, sides[i][0]) * cross(a, b, sides[i][1]) < 0.0
        for i in range(count)
        for a, b in sides[i + 2 :]
    )


def _turns(corners: Sequence[Vector]) -> list[float]:
    """The angle by which the border turns at each corner, to the left, rad."""
    count = len(corners)
    ways = [math.atan2(corners[(i + 1) % count][1] - y, corners[(i + 1) % count][0] - x) for i, (x, y) in
            enumerate(corners)]  # fmt: skip
    return [wrap(ways[i] - ways[i - 1]) for i in range(count)]


def _turning(corners: Sequence[Vector]) -> float:
    return sum(_turns(corners))
