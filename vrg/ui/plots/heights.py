"""Draws how high robots flew, by match time."""

from collections.abc import Mapping
from typing import Final

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from vrg.games.game import Game
from vrg.recording.reader import RobotPoses
from vrg.ui.plots.plotted import rgb

HEIGHTS: Final = "heights.png"
"""The name of the picture in a run folder."""


def heights(tracks: Mapping[str, RobotPoses], game: Game) -> Figure:
    """A line for each robot that flew, in the colour of its last role; dashed ones are physical robots."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for name, track in tracks.items():
        role = next((role for role in reversed(track.roles) if role), "")
        colour, line = rgb(game.style(role).colour), "--" if track.physical else "-"
        axes.plot(track.times, track.z, line, color=colour, linewidth=1.5, label=name)
    figure.legend(loc="outside right upper", frameon=False)  # at the lines, names of those as high would overlap
    axes.set(xlabel="match time, s", ylabel="height, m", ylim=(0.0, None))
    axes.grid(alpha=0.3)
    return figure
