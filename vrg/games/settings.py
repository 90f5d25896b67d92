"""Settings that the [rules] tables of several games have in common."""

from typing import Annotated, Literal

from pydantic import Field as Setting

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
