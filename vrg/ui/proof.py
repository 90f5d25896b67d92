"""Draws why a call was made: a picture to scale of the instant, and the seconds before as a strip."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke

from vrg.bus.messages import PlayerStatus, Zone
from vrg.coordinator.proof import Case, Measure
from vrg.coordinator.rulebook import Observation
from vrg.games.game import Game
from vrg.geometry import corners
from vrg.regions import Bounds, Region
from vrg.types import Pose, Vector
from vrg.ui.plot import draw_zones, rgb
from vrg.ui.scene import clock_text

SECONDS: Final = 3.0
"""The match time in s before a call that is shown."""
STRIP: Final = (3.0, 2.0, 1.0, 0.5)
"""How long before the call the pictures of the strip are, s."""
MARGIN: Final = 1.5
"""What is shown around the players of the call, m."""
_WIDTH: Final = 11.0
"""The width of the paper, inches."""
_NEARBY: Final = 1e-3
_HALO: Final = withStroke(linewidth=2.5, foreground="white")
_DECIDED: Final = "#c02020"


class Scenery:
    """What a proof is drawn on.

    Args:
        game: the game. statuses: of all players, at the call. sizes: the (length, width) of each body, m.
        zones, obstacles: as in the match.
    """

    def __init__(
        self,
        game: Game,
        statuses: Sequence[PlayerStatus],
        sizes: Mapping[str, Vector],
        zones: Sequence[Zone],
        obstacles: Sequence[Region],
    ) -> None:
        self.game = game
        self.zones = zones
        self.obstacles = obstacles
        self._sizes = sizes
        self._colours = {s.name: rgb(game.style(s.role, s.state).colour) for s in statuses}

    def draw_ground(self, axes: Axes, box: Bounds) -> None:
        """Draw walls and zones, and show no more than `box`, m."""
        for obstacle in self.obstacles:
            axes.add_patch(Polygon(obstacle.outline(), facecolor="0.72", edgecolor="0.5", linewidth=0.8, zorder=1.0))
        draw_zones(axes, self.zones, self.game)
        axes.set(xlim=(box[0], box[2]), ylim=(box[1], box[3]), aspect="equal")

    def draw_body(self, axes: Axes, name: str, pose: Pose, *, faint: bool = False) -> None:
        """Draw a robot to scale, with a line ahead."""
        colour = self._colours.get(name, (0.5, 0.5, 0.5))
        size = self._sizes[name]
        face, edge = (0.1, 0.4) if faint else (0.45, 1.0)
        outline = corners(pose, *size)
        axes.add_patch(
            Polygon(outline, facecolor=(*colour, face), edgecolor=(*colour, edge), linewidth=1.0, zorder=3.0)
        )
        front = corners(pose, size[0], 0.0)[0]
        axes.plot([pose.x, front[0]], [pose.y, front[1]], color=colour, alpha=edge, zorder=3.1)

    def above(self, name: str, pose: Pose) -> Vector:
        """Where the name of a robot is written: above its body, m."""
        return pose.x, max(y for _, y in corners(pose, *self._sizes[name]))


def draw_proof(
    out_png: Path, case: Case, measures: Sequence[Measure], scenery: Scenery, fields: Sequence[Observation], title: str
) -> None:
    """Draw why a call was made.

    Args:
        out_png: the file to write. measures: the numbers that decided it.
        fields: where everybody was in the seconds before, by time.
        title: above the picture.

    Raises:
        OSError: the file cannot be written.
        ValueError: the call has no place.
    """
    places = dict(zip(case.call.players, case.call.poses, strict=False))
    if not places:
        raise ValueError(f"call {case.call.number} ({case.call.rule}) has no place on the field")
    box = _box(places, measures, [field.poses.get(name) for field in fields for name in places])
    # The paper is as high as what is shown, so that nothing is wasted.
    share = (box[3] - box[1]) / (box[2] - box[0])
    heights = (_WIDTH * share + 0.9, _WIDTH / len(STRIP) * share + 0.3)
    figure = Figure(figsize=(_WIDTH, sum(heights) + 0.4), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, len(STRIP), height_ratios=heights)
    large = figure.add_subplot(grid[0, :])
    scenery.draw_ground(large, box)
    _draw_trails(large, places, fields)
    for name, pose in case.now.poses.items():
        if name not in places and box[0] <= pose.x <= box[2] and box[1] <= pose.y <= box[3]:
            scenery.draw_body(large, name, pose, faint=True)
            _write(large, name, scenery.above(name, pose), "0.45")
    for name, pose in places.items():
        scenery.draw_body(large, name, pose)
        _write(large, name, scenery.above(name, pose), "black")
    for measure in measures:
        _draw_measure(large, measure)
    large.set(xlabel="x, m", ylabel="y, m")
    large.grid(True, color="0.93", linewidth=0.6)
    large.set_axisbelow(True)
    for column, before in enumerate(STRIP):
        axes = figure.add_subplot(grid[1, column])
        _draw_then(axes, case, scenery, fields, before, box)
    figure.suptitle(title, fontsize=13, fontweight="bold", x=0.01, horizontalalignment="left")
    told = "\n".join(map(str, measures))
    large.set_title(told or clock_text(case.call.clock), fontsize=10, loc="left", color=_DECIDED if told else "0.3")
    figure.savefig(out_png, dpi=110, format="png")


def _draw_then(
    axes: Axes, case: Case, scenery: Scenery, fields: Sequence[Observation], before: float, box: Bounds
) -> None:
    """Draw one picture of the strip."""
    scenery.draw_ground(axes, box)
    axes.set(xticks=[], yticks=[])
    axes.set_title(f"{before:g} s before", fontsize=9)
    then = min(fields, key=lambda field: abs(field.time - (case.now.time - before)), default=None)
    if then is None or abs(then.time - (case.now.time - before)) > 0.25:
        axes.text(0.5, 0.5, "not seen", ha="center", va="center", transform=axes.transAxes, color="0.5")
        return
    for name, pose in then.poses.items():
        scenery.draw_body(axes, name, pose, faint=name not in case.call.players)


def _draw_trails(axes: Axes, places: Mapping[str, Pose], fields: Sequence[Observation]) -> None:
    for name in places:
        way = [(field.poses[name].x, field.poses[name].y) for field in fields if name in field.poses]
        if way:
            axes.plot(*zip(*way, strict=True), color="0.55", linewidth=1.2, linestyle=":", zorder=2.0)


def _draw_measure(axes: Axes, measure: Measure) -> None:
    if measure.ends is None:
        return
    (x0, y0), (x1, y1) = measure.ends
    axes.plot([x0, x1], [y0, y1], color=_DECIDED, linewidth=1.8, marker="o", markersize=3.5, zorder=5.0)
    if abs(x1 - x0) + abs(y1 - y0) > _NEARBY:
        axes.annotate(
            measure.short, ((x0 + x1) / 2, (y0 + y1) / 2), xytext=(6, 6), textcoords="offset points", fontsize=10,
            fontweight="bold", color=_DECIDED, path_effects=[_HALO], zorder=6.0, annotation_clip=True,
        )  # fmt: skip


def _write(axes: Axes, text: str, place: Vector, colour: str) -> None:
    axes.annotate(
        text, place, xytext=(0, 3), textcoords="offset points", ha="center", fontsize=10, color=colour,
        path_effects=[_HALO], zorder=5.5, annotation_clip=True,
    )  # fmt: skip


def _box(places: Mapping[str, Pose], measures: Sequence[Measure], before: Sequence[Pose | None]) -> Bounds:
    """The bounds of what is shown, m: the players, where they came from, and what was measured, if that is near."""
    here = [(pose.x, pose.y) for pose in places.values()]
    points = here + [(pose.x, pose.y) for pose in before if pose is not None]
    first = here[0]
    for measure in measures:
        points += [end for end in measure.ends or () if abs(end[0] - first[0]) + abs(end[1] - first[1]) < 4 * MARGIN]
    xs, ys = zip(*points, strict=True)
    x_min, x_max, y_min, y_max = min(xs) - MARGIN, max(xs) + MARGIN, min(ys) - MARGIN, max(ys) + MARGIN
    # About as wide as the paper, so that nothing is wasted.
    wanted = 1.6 * (y_max - y_min)
    if x_max - x_min < wanted:
        middle = (x_min + x_max) / 2
        x_min, x_max = middle - wanted / 2, middle + wanted / 2
    return x_min, y_min, x_max, y_max
