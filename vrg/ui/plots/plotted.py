"""Draws figures and words upon a panel of a plot with matplotlib."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke

from vrg.colours import Rgb
from vrg.figures import Figure, Shape
from vrg.regions import Bounds
from vrg.types import Vector
from vrg.ui.labels import Placer, Wanted, line_to

HALO: Final = withStroke(linewidth=2.5, foreground="white")
"""A white edge around letters, so that they can be read upon lines."""
POINTS: Final = 0.6
"""Points of a plot for a pixel of a window."""

Colour = tuple[float, float, float]
"""Red, green, blue, each 0 to 1."""

_HEIGHT: Final = 11.0
"""The height of a line of text, points."""


@dataclass
class Labels:
    """Writes beside points of one panel, where possible not over other words, nor over a border.

    Args:
        metre: its length on paper, in points. panel: what the panel shows, m.
    """

    metre: float
    panel: Bounds
    _taken: list[Bounds] = field(default_factory=list)
    _placer: Placer = field(default_factory=Placer)

    def write(self, axes: Axes, text: str, at: Vector, colour: Colour, *, bold: bool) -> None:
        """Write beside `at`, m."""
        width, (x, y) = (5.9 if bold else 5.2) * len(text) + 4, (at[0] * self.metre, at[1] * self.metre)
        about = (x, y), 5.0
        [box] = self._placer.place([Wanted(text, (width, _HEIGHT), about)], self._on_paper(self.panel), self._taken)
        self._taken.append(box)
        led = line_to(box, about) is not None
        axes.annotate(
            text, at, xytext=(box[0] - x + 2, box[1] - y + 2), textcoords="offset points",
            fontsize=8.5 if bold else 8, fontweight="bold" if bold else "normal", color=colour, path_effects=[HALO],
            zorder=7, arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.6} if led else None,
        )  # fmt: skip

    def keep_clear(self, at: Vector, width: float = 12.0, height: float = 12.0) -> None:
        """Keep words away from what is drawn about this point, m; it is `width` by `height` points large."""
        x, y = at[0] * self.metre, at[1] * self.metre
        self._taken.append((x - width / 2, y - height / 2, x + width / 2, y + height / 2))

    def keep_off(self, outline: Sequence[Vector]) -> None:
        """Keep words away from the sides of an outline, m, that lie along x or y."""
        for start, end in zip(outline, [*outline[1:], outline[0]], strict=True):
            box = min(start[0], end[0]), min(start[1], end[1]), max(start[0], end[0]), max(start[1], end[1])
            if box[0] == box[2] or box[1] == box[3]:
                left, bottom, right, top = self._on_paper(box)
                self._taken.append((left - 1, bottom - 1, right + 1, top + 1))

    def _on_paper(self, box: Bounds) -> Bounds:
        left, bottom, right, top = (edge * self.metre for edge in box)
        return left, bottom, right, top


def draw_figures(axes: Axes, figures: Sequence[Figure], labels: Labels) -> None:
    """Draw figures, the first one lowest and all below what a plot shows.

    Args:
        labels: what must not write over the words painted upon the ground.
    """
    for number, figure in enumerate(figures):
        order = 0.5 + number / (len(figures) + 1)
        # What stands is drawn upright in a plot, too, and nothing in it is turned.
        x, y = figure.at.x, figure.at.y
        open_lines: dict[tuple[Rgb, float], list[list[Vector]]] = {}
        for shape in figure.shapes:
            points = [(x + px, y + py) for px, py in shape.points]
            edge, width = None if shape.line is None else rgb(shape.line), POINTS * shape.width
            if shape.line is not None and not shape.closed:
                open_lines.setdefault((shape.line, width), []).append(points)
            else:
                _patch(axes, shape, points, edge, width, order)
        for (colour, width), lines in open_lines.items():
            axes.add_collection(LineCollection(lines, colors=[rgb(colour)], linewidths=width, zorder=order))
        _paint(axes, figure, labels, order)


def _patch(axes: Axes, shape: Shape, points: list[Vector], edge: Colour | None, width: float, order: float) -> None:
    face = "none" if shape.fill is None else rgb(shape.fill)
    style = {"facecolor": face, "edgecolor": edge or "none", "linewidth": width, "zorder": order}
    for patch in [Circle(point, shape.radius) for point in points] if shape.radius else [Polygon(points)]:
        patch.set(**style)
        axes.add_patch(patch)


def _paint(axes: Axes, figure: Figure, labels: Labels, order: float) -> None:
    """Write the words painted upon the ground, upright where that has more room."""
    writing = figure.writing
    if writing is None:
        return
    along, across = (length * labels.metre for length in writing.along)
    size = min(POINTS * writing.size, max(along, across))
    if size < 5.0:
        return
    x, y = writing.middle
    place, words = (x, y - writing.drop), "\n".join(writing.lines)
    upright = min(across, size) > min(along, size)
    axes.text(
        *place, words, ha="center", va="center", fontsize=size, color=rgb(writing.ink), zorder=order,
        rotation=90 if upright else 0,
    )  # fmt: skip
    sides = 0.75 * size * max(map(len, writing.lines)), 1.25 * size * len(writing.lines)
    labels.keep_clear(place, *(sides[::-1] if upright else sides))


def rgb(colour: Rgb) -> Colour:
    """A colour as matplotlib wants it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255
