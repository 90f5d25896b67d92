"""Draws the cross table of a tournament as a heat map, with the ratings beside it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from vrg.colours import BLUE
from vrg.files import write_whole
from vrg.ui.letters import png_of


def plot_cross_table(
    path: Path,
    title: str,
    labels: Sequence[str],
    shares: Sequence[Sequence[float | None]],
    cells: Sequence[Sequence[str]],
    ratings: Sequence[tuple[float, float]],
) -> None:
    """Plot a tournament as a PNG file.

    Args:
        path: the file. title: above the table.
        labels: the strategies, in the order of the rows and of the columns.
        shares: the share, 0 to 1, of the strategy of the row against that of the column. cells: the same as texts.
        ratings: the mean and the standard deviation of the rating of each strategy.

    Raises:
        OSError: the file cannot be written.
    """
    n = len(labels)
    size = 0.9 * n + 1.5
    figure = Figure(figsize=(size + 4.0, max(3.2, size)), layout="constrained")
    FigureCanvasAgg(figure)
    table, rated = figure.subplots(1, 2, width_ratios=(size, 3.0))
    _draw_cells(table, labels, shares, cells)
    values, sigma = np.array(ratings, dtype=float).reshape(-1, 2).T
    colour = tuple(part / 255 for part in BLUE)
    rated.errorbar(values, np.arange(n), xerr=2 * sigma, fmt="o", color=colour, capsize=4, linewidth=1.6)
    rated.set(ylim=(n - 0.5, -0.5), xlabel="rating, and twice sigma")
    rated.set_yticks(np.arange(n), labels=[""] * n)
    rated.grid(True, color="0.92", linewidth=0.6)
    rated.set_axisbelow(True)
    figure.suptitle(title, fontsize=11)
    write_whole(path, png_of(figure))


def _draw_cells(
    axes: Axes, labels: Sequence[str], shares: Sequence[Sequence[float | None]], cells: Sequence[Sequence[str]]
) -> None:
    """The shares as colours, with their texts."""
    n = len(labels)
    values = np.array([[np.nan if share is None else 100 * share for share in line] for line in shares])
    picture = axes.imshow(np.ma.masked_invalid(values), cmap="RdBu", vmin=0, vmax=100, aspect="auto")
    axes.set_facecolor("0.9")
    for i in range(n):
        for j in range(n):
            pale = np.isnan(values[i, j]) or 20 < values[i, j] < 80
            axes.text(j, i, cells[i][j], ha="center", va="center", color="black" if pale else "white", fontsize=10)
    axes.set_xticks(np.arange(n), labels=labels, rotation=30, ha="right", rotation_mode="anchor")
    axes.set_yticks(np.arange(n), labels=labels)
    axes.set(xlabel="against", ylabel="share of the points of")
    axes.figure.colorbar(picture, ax=axes, label="%", fraction=0.05)
