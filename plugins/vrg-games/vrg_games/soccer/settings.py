"""The [rules] of soccer: the field and its numbers. The field is about the map's origin; reds attack along +x."""

from pydantic import Field as Setting
from pydantic import model_validator

from vrg.games.settings import Pitch
from vrg.regions import Circle, Rectangle
from vrg.types import Vector
from vrg_games.soccer import BLUES, REDS

SIDE = {REDS: -1.0, BLUES: 1.0}
"""The sign of x at a team's own goal."""


class Settings(Pitch):
    """The [rules] table of a match file; lengths are in m, times in s of play.

    Args:
        goal: the width of a goal. depth: its depth.
        area_length, area_width: those of a defence area. circle: the radius of the centre circle.
        inside: how far inside the lines kicks are taken.
        kick_time: until a free kick is over that nobody takes. stuck: until a ball without progress is moved.
        time: that of the match.
    """

    goal: float = Setting(1.0, ge=0.2, le=50)
    depth: float = Setting(0.18, ge=0.05, le=5)
    area_length: float = Setting(0.8, ge=0.1, le=20)
    area_width: float = Setting(1.6, ge=0.2, le=50)
    circle: float = Setting(0.5, ge=0.1, le=10)
    inside: float = Setting(0.2, ge=0.05, le=5)
    kick_time: float = Setting(8.0, ge=1, le=60)
    stuck: float = Setting(8.0, ge=2, le=60)
    time: float = Setting(120.0, gt=0, le=1e5)

    @model_validator(mode="after")
    def _fits(self) -> "Settings":
        if not self.goal <= self.area_width <= self.width - 4 * self.inside:
            raise ValueError("expected goal <= area_width <= width - 4 inside, so that there is room for corner kicks")
        if self.area_length + self.inside >= self.length / 2:
            raise ValueError("expected area_length + inside below half of the length")
        return self

    @property
    def middle(self) -> Circle:
        """The centre circle."""
        return Circle(0.0, 0.0, self.circle)

    def goal_of(self, team: str) -> Rectangle:
        """The goal that a team defends."""
        near = self.length / 2
        return self.part(SIDE[team], near, near + self.depth, self.goal)

    def area_of(self, team: str) -> Rectangle:
        """The defence area of a team."""
        return self.part(SIDE[team], self.length / 2 - self.area_length, self.length / 2, self.area_width)

    def legal(self, x: float, y: float) -> Vector:
        """The nearest place for a kick: inside the lines, and in front of defence areas."""
        far, aside = self.length / 2 - self.inside, self.width / 2 - self.inside
        x, y = min(max(x, -far), far), min(max(y, -aside), aside)
        if abs(y) <= self.area_width / 2 + self.inside:
            free = self.length / 2 - self.area_length - self.inside
            x = min(max(x, -free), free)
        return x, y
