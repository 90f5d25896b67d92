"""What the [rules] tables of several games have in common."""

from collections.abc import Iterable, Sequence
from typing import Annotated, Literal, Self

from pydantic import Field as Setting
from pydantic import model_validator

from vrg.coordinator.rulebook import Contestant
from vrg.errors import Problem
from vrg.regions import Rectangle
from vrg.tables import Table

Coordinate = Annotated[float, Setting(ge=-1e4, le=1e4)]
"""A coordinate on the field, m."""


class LineUp(Table):
    """The way in which players come to their marks before a round.

    Args:
        lineup: `drive` lets players drive to their marks; `place` puts virtual robots there at once.
        lineup_limit: the time in s after which virtual robots that are not on their marks are put there.
    """

    lineup: Literal["drive", "place"] = "drive"
    lineup_limit: float = Setting(60.0, gt=0)

    @property
    def patience(self) -> float:
        """The time in s after which virtual robots are put on their marks."""
        return 0.0 if self.lineup == "place" else self.lineup_limit


class Borders(Table):
    """A rectangular field by its borders, m.

    Args:
        x, y: the (low, high) borders.
    """

    x: tuple[Coordinate, Coordinate]
    y: tuple[Coordinate, Coordinate]

    @model_validator(mode="after")
    def _low_first(self) -> Self:
        for name, (low, high) in (("x", self.x), ("y", self.y)):
            if not low < high:
                raise ValueError(f"{name}: expected the low border first, got [{low}, {high}]")
        return self

    @property
    def field(self) -> Rectangle:
        """The field."""
        return Rectangle(self.x[0], self.y[0], self.x[1], self.y[1])


class Pitch(Table):
    """A rectangular field about the map's origin, which two teams divide: one has the low x, the other the high x.

    Args:
        length, width: along x and along y, m.
    """

    length: float = Setting(6.0, ge=2, le=100)
    width: float = Setting(4.0, ge=1, le=100)

    @property
    def field(self) -> Rectangle:
        """The field."""
        return Rectangle(-self.length / 2, -self.width / 2, self.length / 2, self.width / 2)

    @staticmethod
    def part(side: float, near: float, far: float, width: float) -> Rectangle:
        """The part of one side between two distances from the middle line, about the x axis, m.

        Args:
            side: 1 for that of high x, and -1 for that of low x.
        """
        low, high = sorted((side * near, side * far))
        return Rectangle(low, -width / 2, high, width / 2)


def none_of(roles: Iterable[str], contestants: Sequence[Contestant]) -> list[Problem]:
    """A problem for each role that no player has."""
    played = {c.role for c in contestants}
    return [Problem(f"expected at least one {r}, got none", ("players",)) for r in roles if r not in played]


def aerial_problems(scouts: Sequence[str], contestants: Sequence[Contestant]) -> list[Problem]:
    """A problem for each scout on the ground, and for each other player in the air.

    Args:
        scouts: the roles of scouts.
    """
    needs = 'a scout needs a robot whose camera looks down: write model = "Crazyflie"'
    above = f"a robot in the air can only be a {' or a '.join(scouts)}: give it that role, or a model that drives"
    return [
        Problem(above if c.overview is not None else needs, ("players", c.name))
        for c in contestants
        if (c.role in scouts) != (c.overview is not None)
    ]
