"""Writes words beside points of a plot so that they do not cover each other."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from vrg.regions import Bounds, Rectangle, Region, touch
from vrg.types import Vector

HALO: Final = withStroke(linewidth=2.5, foreground="white")
"""A white edge around letters, so that they can be read upon lines."""

Colour = tuple[float, float, float]
"""Red, green, blue, each 0 to 1."""

_HEIGHT: Final = 11.0
"""Of a line of text, in points."""


@dataclass
class Labels:
    """Writes beside points of one panel, where possible not over other words, nor over a border.

    Args:
        metre: its length on paper, in points.
        panel: what the panel shows, m. borders: regions whose outlines are drawn in it.
    """

    metre: float
    panel: Bounds
    borders: Sequence[Region] = ()
    _taken: list[Bounds] = field(default_factory=list)

    def write(self, axes: Axes, text: str, at: Vector, colour: Colour, *, bold: bool) -> None:
        """Write beside `at`, m, at the best of sixteen places."""
        width = (5.9 if bold else 5.2) * len(text) + 4
        x, y = at[0] * self.metre, at[1] * self.metre
        middle = -width / 2
        places = [
            (9.0, 3.0), (9.0, -14.0), (-9.0 - width, 3.0), (-9.0 - width, -14.0),
            (9.0, 15.0), (9.0, -26.0), (middle, 11.0), (middle, -22.0), (-9.0 - width, 15.0), (-9.0 - width, -26.0),
            (9.0, 27.0), (9.0, -38.0), (middle, 23.0), (middle, -34.0), (-9.0 - width, 27.0), (-9.0 - width, -38.0),
        ]  # fmt: skip
        boxes = [(x + dx, y + dy, x + dx + width, y + dy + _HEIGHT) for dx, dy in places]
        chosen = min(range(len(places)), key=lambda index: self._cost(boxes[index]))
        self._taken.append(boxes[chosen])
        axes.annotate(
            text, at, xytext=places[chosen], textcoords="offset points", fontsize=8.5 if bold else 8,
            fontweight="bold" if bold else "normal", color=colour, path_effects=[HALO], zorder=7,
        )  # fmt: skip

    def keep_clear(self, at: Vector, width: float = 12.0, height: float = 12.0) -> None:
        """Keep words away from what is drawn about this point, m; it is `width` by `height` points large."""
        x, y = at[0] * self.metre, at[1] * self.metre
        self._taken.append((x - width / 2, y - height / 2, x + width / 2, y + height / 2))

    def _cost(self, box: Bounds) -> int:
        """The cost of a place: outside the panel is worse than upon other words, and that worse than upon a border."""
        in_metres = Rectangle(*(edge / self.metre for edge in box))
        inside = all(Rectangle(*self.panel).contains(x, y) for x, y in in_metres.outline())
        taken = any(_meet(box, other) for other in self._taken)
        crossed = any(_crosses(in_metres, region) for region in self.borders)
        return 4 * (not inside) + 2 * taken + crossed


def _crosses(box: Rectangle, region: Region) -> bool:
    """True if the outline of the region runs through the box."""
    return touch(box, region) and not all(region.contains(x, y) for x, y in box.outline())


def _meet(a: Bounds, b: Bounds) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
