"""Draws how two strategies compare: the share of the points with its interval, and what the games were like."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from vrg.colours import GREEN, PURPLE
from vrg.files import write_whole
from vrg.ui.letters import png_of

Share = tuple[int, float, float, float]
"""A number of games, and after it the share of the first strategy and the ends of its interval, 0 to 1."""

_COLOURS: Final = tuple(tuple(part / 255 for part in colour) for colour in (PURPLE, GREEN))
"""Those of the two strategies, which no team of the games of VRG has."""
_BINS: Final = 12
"""The most bins of a histogram."""


def plot_comparison(
    path: Path,
    title: str,
    strategies: tuple[str, str],
    shares: Sequence[Share],
    scores: Mapping[str, Mapping[str, Sequence[float]]],
    times: Mapping[str, Sequence[float]],
) -> None:
    """Plot a comparison as a PNG file.

    Args:
        path: the file. title: what was found.
        strategies: the first strategy, whose share is drawn, and the second.
        shares: the share after each pair of games.
        scores: for each team, under the words for its score, the scores that each strategy reached as this team.
        times: the time of play of the games in s, by who played which team: first the games in which the first strategy
            played the first team.

    Raises:
        OSError: the file cannot be written.
    """
    figure = Figure(figsize=(10.0, 6.8), layout="constrained")
    FigureCanvasAgg(figure)
    panels = len(scores) + 1
    grid = figure.add_gridspec(2, panels, height_ratios=(1.15, 1.0))
    _draw_shares(figure.add_subplot(grid[0, :]), strategies[0], shares)
    for number, (words, by_strategy) in enumerate(scores.items()):
        axes = figure.add_subplot(grid[1, number])
        _draw_histograms(axes, {name: by_strategy.get(name, ()) for name in strategies}, whole=True)
        axes.set(xlabel=words, ylabel="games" if number == 0 else "")
    axes = figure.add_subplot(grid[1, panels - 1])
    _draw_histograms(axes, times, whole=False)
    axes.set(xlabel="time of play, s")
    figure.suptitle("\n".join(textwrap.wrap(title, 110)), fontsize=11)
    write_whole(path, png_of(figure))


def _draw_shares(axes: Axes, first: str, shares: Sequence[Share]) -> None:
    """The share over the number of games, and the band of its intervals."""
    games, share, low, high = np.array(shares, dtype=float).reshape(-1, 4).T
    mark = "o" if games.size < 2 else ""
    axes.fill_between(games, 100 * low, 100 * high, color=_COLOURS[0], alpha=0.2, linewidth=0, label="interval")
    axes.plot(games, 100 * share, color=_COLOURS[0], marker=mark, linewidth=1.8, label=f"share of {first}")
    axes.axhline(50.0, color="0.25", linewidth=1.0, linestyle="--", label="equally good")
    axes.set(xlabel="games", ylabel="share of the points, %", ylim=(0, 100))
    axes.set_xlim(0.0, float(games.max()) * 1.02 if games.size else 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.legend(loc="best", fontsize=9)


def _draw_histograms(axes: Axes, values: Mapping[str, Sequence[float]], *, whole: bool) -> None:
    """Draw the frequency of each value, with an outline for each name."""
    everything = [value for some in values.values() for value in some]
    if not everything:
        return
    low, high = min(everything), max(everything)
    if whole:
        step = max(1, -(-int(high - low + 1) // _BINS))
        edges = np.arange(low - 0.5, high + 0.5 + step, step)
    else:
        edges = np.linspace(low, high if high > low else low + 1.0, _BINS + 1)
    for (name, some), colour in zip(values.items(), _COLOURS, strict=False):
        counts, _ = np.histogram(some, edges)
        axes.stairs(counts, edges, color=colour, alpha=0.25, fill=True)
        axes.stairs(counts, edges, color=colour, linewidth=1.6, label=name)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if whole:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(0.0, 1.35 * axes.dataLim.y1)
    axes.legend(loc="upper left", fontsize=8, framealpha=0.8)
