"""The [rules] tables of both games. Lengths in m, times in s."""

from pydantic import Field as Setting

from vrg.games.settings import Borders, Coordinate
from vrg.regions import Rectangle


class Settings(Borders):
    """What both games have; the hunted must stay on the field.

    Args:
        capture_distance: between two centres.
        ratio: the top speed of the hunted, as a share of the hunter's, which is that of the slowest robot.
        time: of play in a round. rounds: how many there are.
    """

    x: tuple[Coordinate, Coordinate] = (-6.0, 6.0)
    y: tuple[Coordinate, Coordinate] = (-4.0, 4.0)
    capture_distance: float = Setting(0.8, gt=0, le=100)
    ratio: float = Setting(0.7, gt=0, lt=1)
    time: float = Setting(120.0, gt=0, le=1e6)
    rounds: int = Setting(1, ge=1, le=100)

    @property
    def port(self) -> Rectangle | None:
        """Where the hunted are at home; None if there is no such place."""
        return None


class MarcoPoloSettings(Settings):
    """Marco Polo.

    Args:
        pause: the least time between two calls.
        grid: places are heard as the middles of squares of this width.
    """

    pause: float = Setting(4.0, ge=0.1, le=1e6)
    grid: float = Setting(1.0, gt=0, le=100)


class ApolloniusSettings(Settings):
    """Apollonius' pursuit.

    Args:
        harbour: how wide the harbour is, a strip along the low border of x.
    """

    harbour: float = Setting(1.0, gt=0, le=1e4)

    @property
    def port(self) -> Rectangle:
        """The harbour."""
        return Rectangle(self.x[0], self.y[0], min(self.x[0] + self.harbour, self.x[1]), self.y[1])
