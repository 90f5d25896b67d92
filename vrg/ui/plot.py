"""Draws the trajectories of a match for a report: a panel for each round, metres on both axes."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from vrg.bus.messages import LARGE_ZONES, FieldObject, Zone
from vrg.colours import ON_WHITE, Rgb
from vrg.games import UNKNOWN_GAME, game_of
from vrg.games.game import Game, Marker, Moment
from vrg.recording.reader import RobotPoses, read_calls, read_setting, read_tracks
from vrg.recording.records import CallRecord
from vrg.regions import Bounds, Region, surrounding
from vrg.ui.labels import HALO, Colour, Labels
from vrg.ui.scene import JUMP, clock_text
from vrg.ui.thoughts import Thoughts

CALLS_IN_WORDS: Final = 8
"""The most calls in a panel that are told beside their marks. More of them are numbered and told in the legend."""
LETTER: Final = 0.075
"""The width of a letter of the legend, inches."""
LEGEND_LINES: Final = 36
"""The lines of the legend in one column."""
_ROLE_MARKERS: Final = {
    Marker.TRIANGLE: "^",
    Marker.CIRCLE: "o",
    Marker.SQUARE: "s",
    Marker.DIAMOND: "D",
    Marker.CROSS: "X",
}


def plot_trajectories(
    recording: Path | Sequence[Path] | Mapping[str, RobotPoses],
    out_png: Path,
    *,
    calls: Sequence[CallRecord] | None = None,
    zones: Mapping[int, Sequence[Zone]] | None = None,
    thoughts: Thoughts | None = None,
    obstacles: Sequence[Region] = (),
    title: str = "",
    game: str = "",
) -> None:
    """Plot where each player drove while the rounds were played.

    A colour for each player; solid lines are virtual robots, dashed ones physical. A hollow circle is where it
    began, its role's marker where it ended. The calls that the game says are marked, with the player, the play clock
    and who else took part; where there are many, their numbers stand for that, and the legend tells it. Where the game
    is not installed here, every call that has a place is marked. Small dots are what players have seen, and thin dashed
    lines what a player sketched when a call was made, where the game asks for that.

    Args:
        recording: an MCAP file, its parts, or tracks read from one.
        calls: of the match. zones: by round. thoughts: of the players. game: its name. All are read from the recording
            where they are not given.
        obstacles: the ground that the map's walls and obstacles cover, m.
        title: above the panels.

    Raises:
        OSError: a file cannot be read or written.
        MessageError: the file is not a recording.
        ValueError: there is no track to plot.
    """
    if not isinstance(recording, Mapping):
        tracks = read_tracks(recording)
        calls = read_calls(recording) if calls is None else calls
        setting = read_setting(recording)
        zones = setting.zones if zones is None else zones
        game = game or setting.game
        objects = setting.objects
        thoughts = Thoughts.read(recording) if thoughts is None else thoughts
    else:
        tracks, objects = dict(recording), ()
    calls, zones, thoughts, shown_as = calls or (), zones or {}, thoughts or Thoughts(), game_of(game)
    moments = _moments(shown_as, calls)
    if not any(track.times.size for track in tracks.values()):
        raise ValueError(f"expected at least one track with a pose, got {len(tracks)} tracks")
    rounds = _rounds(tracks)
    box = _extent(tracks, zones)
    marked = {n: [c for c in calls if c.rule in moments and n in (c.round, 0) and c.poses] for n in rounds}
    listed = [call for of_round in marked.values() if len(of_round) > CALLS_IN_WORDS for call in of_round]
    tracks = {name: tracks[name] for name in sorted(tracks, key=_natural)}
    colours = {name: _colour(index) for index, name in enumerate(tracks)}
    handles = [*_legend(tracks, rounds, colours, calls, shown_as), *thoughts.legend(moments.values())]
    handles += [_listed(number, _words_of(call, moments)) for number, call in enumerate(listed, 1)]
    columns = -(-len(handles) // LEGEND_LINES)
    longest = max(len(str(handle.get_label())) for handle in handles)
    figure, panels, metre = _figure(len(rounds), box, columns * (0.75 + LETTER * longest))
    numbers = iter(range(1, len(listed) + 1))
    for axes, number in zip(panels, rounds, strict=True):
        here = zones.get(number, ())
        labels = Labels(metre, box, [zone.region for zone in here if zone.kind == "field"])
        for obstacle in obstacles:
            axes.add_patch(Polygon(obstacle.outline(), facecolor="0.72", edgecolor="0.5", linewidth=0.8, zorder=1.0))
        draw_zones(axes, here, shown_as, labels)
        _draw_objects(axes, objects, labels, shown_as)
        for track in tracks.values():
            ends = np.flatnonzero(_shown(track, number))
            for end in (0, -1) if ends.size else ():
                labels.keep_clear((float(track.x[ends[end]]), float(track.y[ends[end]])))
        for name, track in tracks.items():
            _draw_track(axes, track, number, colours[name], labels, shown_as)
        for call in marked[number]:
            labels.keep_clear((call.poses[0].x, call.poses[0].y), width=17.0, height=17.0)
        thoughts.draw_sightings(axes, colours, *_lasted(tracks, number))
        for call in marked[number]:
            thoughts.draw_at(axes, call, moments[call.rule], colours, labels)
            words = str(next(numbers)) if len(marked[number]) > CALLS_IN_WORDS else _words_of(call, moments)
            _draw_call(axes, call, moments[call.rule].sign, words, labels)
        axes.set(xlim=(box[0], box[2]), ylim=(box[1], box[3]), xlabel="x, m", aspect="equal")
        axes.grid(True, color="0.92", linewidth=0.6)
        axes.set_axisbelow(True)
        if number:
            axes.set_title(f"{shown_as.round_word.capitalize()} {number}", fontsize=11)
    panels[0].set_ylabel("y, m")
    if title:
        figure.suptitle(title, fontsize=14, fontweight="bold", x=0.01, horizontalalignment="left")
    figure.legend(
        handles=handles, loc="outside right upper", frameon=False, fontsize=9, handlelength=2.6, ncols=columns
    )
    figure.savefig(out_png, dpi=130, format="png", bbox_inches="tight", pad_inches=0.15)


def _moments(game: Game, calls: Sequence[CallRecord]) -> Mapping[str, Moment]:
    """The rules whose calls are marked."""
    if game is not UNKNOWN_GAME:
        return game.marked
    return {call.rule: Moment("X", call.rule.replace("_", " ")) for call in calls if call.poses}


def _rounds(tracks: Mapping[str, RobotPoses]) -> list[int]:
    """The rounds that were played; [0] stands for all samples where the referee said nothing of it."""
    played = {int(n) for track in tracks.values() for n in np.unique(track.rounds[track.playing])}
    return sorted(played) or [0]


def _figure(count: int, box: Bounds, legend: float = 2.0) -> tuple[Figure, list[Axes], float]:
    """The figure, its panels, and the length of a metre in points.

    Args:
        count: the number of panels. box: what each of them shows, m. legend: the width of the legend, inches.
    """
    aspect = (box[3] - box[1]) / (box[2] - box[0])
    columns = min(count, 4 if aspect > 1.0 else 2)
    rows = math.ceil(count / columns)
    # The longer side of a panel is about 8 inches, but all of them together have 24 at most. The legend is beside them.
    width, height = (8.0 / aspect, 8.0) if aspect > 1.0 else (8.0, 8.0 * aspect)
    shrink = min(1.0, (24.0 - 0.5 * columns) / (columns * width), (24.0 - 0.7 * rows) / (rows * height))
    width, height = width * shrink, height * shrink
    size = (columns * (width + 0.5) + 0.2 + legend, rows * (height + 0.7) + 0.6)
    figure = Figure(figsize=size, layout="compressed", facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.subplots(rows, columns, squeeze=False, sharey=True)
    panels: list[Axes] = list(grid.flat)
    for spare in panels[count:]:
        spare.set_axis_off()
    return figure, panels[:count], 72 * height / (box[3] - box[1])


def _extent(tracks: Mapping[str, RobotPoses], zones: Mapping[int, Sequence[Zone]]) -> Bounds:
    """The bounds of all that is drawn, with a margin, m."""
    shown = [_shown(track, 0) for track in tracks.values()]
    xs = np.concatenate([track.x[keep] for track, keep in zip(tracks.values(), shown, strict=True)])
    ys = np.concatenate([track.y[keep] for track, keep in zip(tracks.values(), shown, strict=True)])
    driven = (float(xs.min()), float(ys.min()), float(xs.max()), float(ys.max()))
    every = [zone.region.bounds for of_round in zones.values() for zone in of_round]
    x_min, y_min, x_max, y_max = surrounding([driven, *every])
    return x_min - 0.7, y_min - 0.7, x_max + 0.7, y_max + 0.7


def _shown(track: RobotPoses, number: int) -> npt.NDArray[np.bool_]:
    """Which samples belong to the panel of a round; 0 = all that were played, or all there are."""
    if not track.playing.any() and number == 0:
        return np.ones(track.times.shape, dtype=np.bool_)
    return track.playing & (track.rounds == number) if number else track.playing


def _lasted(tracks: Mapping[str, RobotPoses], number: int) -> tuple[float, float]:
    """When a round began and ended, match time, s."""
    times = np.concatenate([track.times[_shown(track, number)] for track in tracks.values()])
    return (float(times.min()), float(times.max())) if times.size else (0.0, 0.0)


def draw_zones(axes: Axes, zones: Sequence[Zone], game: Game, labels: Labels | None = None) -> None:
    """Draw the parts of the field.

    Args:
        labels: what must not write over their names; without it, the names are left out.
    """
    for zone in zones:
        outline = zone.region.outline()
        if zone.kind == "field":
            axes.add_patch(Polygon(outline, fill=False, edgecolor="0.25", linewidth=1.6, zorder=1.5))
            continue
        if zone.team is not None:
            colour = rgb(game.team_style(zone.team).colour)
            axes.add_patch(
                Polygon(
                    outline, facecolor=colour, edgecolor=colour, linewidth=0.8, zorder=0.5,
                    alpha=0.06 if zone.kind in LARGE_ZONES else 0.15,
                )
            )  # fmt: skip
            continue
        safe = zone.kind == "safe"
        axes.add_patch(
            Polygon(
                outline, facecolor="#d9f0e6" if safe else "0.96", edgecolor="#8ccfb4" if safe else "0.85",
                hatch="//" if safe else None, linewidth=0.8, zorder=0.5,
            )
        )  # fmt: skip
        if labels is None:
            continue
        words = zone.name.replace("_", " ")
        axes.text(
            *zone.region.middle, words, ha="center", va="center", fontsize=10, color="#3d8f6f" if safe else "0.6",
            path_effects=[HALO], zorder=0.6,
        )  # fmt: skip
        labels.keep_clear(zone.region.middle, width=6.0 * len(words), height=12.0)


def _draw_objects(axes: Axes, objects: Sequence[FieldObject], labels: Labels, game: Game) -> None:
    """Draw flags in their places."""
    for thing in objects:
        colour = rgb(game.team_style(thing.team or "").colour)
        axes.plot([thing.x, thing.x], [thing.y, thing.y + 0.5], color="0.3", linewidth=1.5, zorder=2.0)
        cloth = [(thing.x, thing.y + 0.5), (thing.x + 0.4, thing.y + 0.37), (thing.x, thing.y + 0.25)]
        axes.add_patch(Polygon(cloth, facecolor=colour, edgecolor="0.3", linewidth=0.6, zorder=2.0))
        labels.keep_clear((thing.x, thing.y), width=14.0, height=20.0)


def _draw_track(axes: Axes, track: RobotPoses, number: int, colour: Colour, labels: Labels, game: Game) -> None:
    keep = np.flatnonzero(_shown(track, number))
    if not keep.size:
        return
    x, y = track.x[keep], track.y[keep]
    # Where a robot was placed elsewhere, or the recording has a gap, no line joins the pieces.
    breaks = np.flatnonzero(np.hypot(np.diff(x), np.diff(y)) > JUMP) + 1
    line_x, line_y = np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan)
    style = (0, (4, 1.6)) if track.physical else "-"
    axes.plot(line_x, line_y, color=colour, linestyle=style, linewidth=1.7, zorder=3, solid_capstyle="round")
    axes.plot(x[0], y[0], "o", color=colour, markerfacecolor="white", markersize=6, markeredgewidth=1.6, zorder=4)
    last = _last_of_round(track, number, int(keep[-1]))
    sign = game.style(track.roles[last], track.states[last]).marker
    gone = game.is_out(track.states[last])
    face = "0.75" if gone else colour
    axes.plot(
        x[-1],
        y[-1],
        _ROLE_MARKERS[sign],
        color=face,
        markeredgecolor=colour,
        markersize=9,
        markeredgewidth=1.2,
        zorder=5,
    )
    labels.write(axes, track.name, (float(x[-1]), float(y[-1])), colour, bold=True)


def _draw_call(axes: Axes, call: CallRecord, sign: str, words: str, labels: Labels) -> None:
    here = (call.poses[0].x, call.poses[0].y)
    axes.plot(*here, sign, color="none", markeredgecolor="black", markersize=15, markeredgewidth=1.2, zorder=6)
    labels.write(axes, words, here, (0.0, 0.0, 0.0), bold=False)


def _words_of(call: CallRecord, moments: Mapping[str, Moment]) -> str:
    """Who was concerned, when, and who else took part: `nemo 0:09.0 by bruce`."""
    whom, *others = call.players or [call.rule]
    return f"{whom} {clock_text(call.clock)}" + (f" {moments[call.rule].others} {', '.join(others)}" if others else "")


def _listed(number: int, words: str) -> Line2D:
    """A call in the legend. In the panel its number stands for it."""
    size = 6.0 if number < 10 else 9.0
    return Line2D(
        [], [], color="black", marker=f"${number}$", markersize=size, markeredgewidth=0.0, linestyle="",
        label=words,
    )  # fmt: skip


def _legend(
    tracks: Mapping[str, RobotPoses],
    rounds: Sequence[int],
    colours: Mapping[str, Colour],
    calls: Sequence[CallRecord],
    game: Game,
) -> Iterator[Line2D]:
    both = {track.physical for track in tracks.values()} == {True, False}
    for name, track in tracks.items():
        roles = list(dict.fromkeys(role for role, playing in zip(track.roles, track.playing, strict=True) if playing))
        label = f"{name} ({', then '.join(roles)})" if roles else name
        yield Line2D([], [], color=colours[name], linestyle="--" if track.physical else "-", linewidth=2, label=label)
    grey = "0.35"
    if both:
        yield Line2D([], [], color=grey, linestyle="--", label="physical robot")
    yield Line2D([], [], color=grey, marker="o", markerfacecolor="white", linestyle="", label="start")
    ends = [
        (track.roles[last], track.states[last])
        for track in tracks.values()
        for number in rounds
        for last in [_last_of_round(track, number, int(i)) for i in np.flatnonzero(_shown(track, number))[-1:]]
    ]
    signs = {(game.style(role, state).marker, state if game.is_out(state) else role) for role, state in ends if role}
    for sign, word in sorted(signs, key=lambda pair: pair[1]):
        yield Line2D([], [], color=grey, marker=_ROLE_MARKERS[sign], linestyle="", label=f"end, {word}")
    for rule, moment in _moments(game, calls).items():
        if any(call.rule == rule for call in calls):
            yield Line2D(
                [], [], color="none", marker=moment.sign, markeredgecolor="black", markersize=10, linestyle="",
                label=moment.word,
            )  # fmt: skip


def _last_of_round(track: RobotPoses, number: int, shown: int) -> int:
    """The last sample of a round: the tag that ends it is known only after the last sample of play."""
    of_round = np.flatnonzero(track.rounds == number)
    return int(of_round[-1]) if of_round.size else shown


def _colour(index: int) -> Colour:
    return rgb(ON_WHITE[index % len(ON_WHITE)])


def rgb(colour: Rgb) -> Colour:
    """A colour as matplotlib wants it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def _natural(name: str) -> tuple[tuple[str, int], ...]:
    """A key that puts p2 before p10: each piece of text with the number that follows it."""
    return tuple((text, int(number or 0)) for text, number in re.findall(r"(\D*)(\d*)", name))
