"""Words beside points of a plot that do not cover each other."""

from dataclasses import dataclass, field
from typing import Final

from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

HALO: Final = withStroke(linewidth=2.5, foreground="white")
"""Around letters, so that they read upon lines."""

Colour = tuple[float, float, float]
"""Red, green, blue, each 0 to 1."""

_Box = tuple[float, float, float, float]


@dataclass
class Labels:
    """Writes beside points of one panel without writing over what it wrote before.

    Args:
        metre: its length on paper, in points.
    """

    metre: float
    _taken: list[_Box] = field(default_factory=list)

    def write(self, axes: Axes, text: str, at: tuple[float, float], colour: Colour, *, bold: bool) -> None:
        """Write at one of four places beside `at`, m: the first that is free, else the first."""
        width, height = 5.4 * len(text) + 4, 11.0
        x, y = at[0] * self.metre, at[1] * self.metre
        places = [(9.0, 3.0), (9.0, -14.0), (-9.0 - width, 3.0), (-9.0 - width, -14.0), (9.0, 15.0), (9.0, -26.0)]
        boxes = [(x + dx, y + dy, x + dx + width, y + dy + height) for dx, dy in places]
        free = (index for index, box in enumerate(boxes) if not any(_meet(box, other) for other in self._taken))
        chosen = next(free, 0)
        self._taken.append(boxes[chosen])
        axes.annotate(
            text, at, xytext=places[chosen], textcoords="offset points", fontsize=8.5 if bold else 8,
            fontweight="bold" if bold else "normal", color=colour, path_effects=[HALO], zorder=7,
        )  # fmt: skip

    def keep_clear(self, at: tuple[float, float]) -> None:
        """Nothing is written upon the marker at this point, m."""
        x, y = at[0] * self.metre, at[1] * self.metre
        self._taken.append((x - 6, y - 6, x + 6, y + 6))


def _meet(a: _Box, b: _Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
