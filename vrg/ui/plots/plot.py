"""Draws the trajectories of a match for a report: a panel for each part of a round, metres on both axes."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from msgspec import structs

from vrg.bus.messages import FieldObject, Zone
from vrg.colours import PAPER, WHITE, mix
from vrg.figures import Figure as Drawn
from vrg.files import write_whole
from vrg.games import UNKNOWN_GAME, game_of, look
from vrg.games.game import Game, Marker, Moment, ThingStyle
from vrg.geometry import compose, wrap
from vrg.recording.reader import RecordedCall, RobotPoses, calls_of, setting_of, tracks_of
from vrg.recording.recorded import read_recorded
from vrg.regions import Bounds, Region, surrounding
from vrg.regions import Polygon as Outlined
from vrg.types import Pose
from vrg.ui.letters import png_of
from vrg.ui.palette import INK
from vrg.ui.plots.heights import HEIGHTS, heights
from vrg.ui.plots.plotted import Colour, Labels, draw_figures, rgb
from vrg.ui.plots.thoughts import Thoughts
from vrg.ui.scene import JUMP, clock_text
from vrg.ui.view import fit

CALLS_IN_WORDS: Final = 8
"""The most calls in a panel that are written beside their marks. More of them are numbered, with a legend."""
LETTER: Final = 0.075
"""The width of a letter of the legend, inches."""
LEGEND_LINES: Final = 36
"""The lines of the legend in one column."""
PART: Final = 30.0
"""The match time in s that a panel shows at most, if that makes no more than MAX_PANELS panels."""
MAX_PANELS: Final = 16
HALT: Final = 1.0
"""The match time in s between two samples of play from which on play was halted meanwhile."""
_NEARLY: Final = 1e-6
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
    calls: Sequence[RecordedCall] | None = None,
    zones: Mapping[int, Sequence[Zone]] | None = None,
    thoughts: Thoughts | None = None,
    obstacles: Sequence[Region] = (),
    title: str = "",
    game: str = "",
    torn: list[Path] | None = None,
) -> None:
    """Plot where each player drove while the rounds were played.

    Players have the colour of their role in windows, each in a shade of its own; solid lines are virtual robots, dashed
    ones physical. The field is turned as windows turn it. A round that lasts longer than PART has several panels. A
    hollow circle is where a player began, its role's marker where it ended. The calls that the game names are marked,
    with the player, the play clock and who else took part; where there are many, their numbers stand for that, and the
    legend tells it. Where the game is not installed here, every call that has a place is marked. Small dots are what
    players have seen, and thin dashed lines what a player sketched when a call was made, where the game asks for that.
    Thin lines are bodies, such as a ball. Of robots that flew, a second picture beside it, HEIGHTS, has the heights.

    Args:
        recording: an MCAP file, its parts, or tracks read from one.
        calls: of the match. zones: by round. thoughts: of the players. game: its name. All are read from the recording
            where they are not given.
        obstacles: the ground that the map's walls and obstacles cover, m.
        title: above the panels. torn: where to note the files that end in the middle or are damaged.

    Raises:
        OSError: a file cannot be read or written.
        MessageError: the file is not a recording.
        ValueError: there is no track to plot.
    """
    if not isinstance(recording, Mapping):
        recorded = read_recorded(recording)
        if torn is not None:
            torn += recorded.torn
        tracks, setting = tracks_of(recorded), setting_of(recorded)
        calls = calls_of(recorded) if calls is None else calls
        zones = setting.zones if zones is None else zones
        game = game or setting.game
        objects, bodies = setting.objects, setting.bodies
        thoughts = Thoughts.of(recorded) if thoughts is None else thoughts
    else:
        tracks, objects, bodies = dict(recording), (), ()
    if not any(track.times.size for track in tracks.values()):
        raise ValueError(f"expected at least one track with a pose, got {len(tracks)} tracks")
    tracks = {name: tracks[name] for name in sorted(tracks, key=_natural)}
    shown = Plotted(
        game_of(game), tracks, calls or (), zones or {}, objects, bodies, obstacles, thoughts or Thoughts()
    ).as_in_windows()
    moments, parts, box = _moments(shown.game, shown.calls), _parts(tracks), shown.extent
    marked = [[c for c in shown.calls if c.rule in moments and c.poses and part.has(c)] for part in parts]
    listed = [call for of_part in marked if len(of_part) > CALLS_IN_WORDS for call in of_part]
    handles = [*_legend(tracks, parts, shown.calls, shown.game), *shown.thoughts.legend(moments.values())]
    handles += [_listed(number, _words_of(call, moments)) for number, call in enumerate(listed, 1)]
    columns = -(-len(handles) // LEGEND_LINES)
    longest = max(len(str(handle.get_label())) for handle in handles)
    figure, panels, metre = _figure(len(parts), box, columns * (0.75 + LETTER * longest))
    numbers = iter(range(1, len(listed) + 1))
    for axes, part, of_part in zip(panels, parts, marked, strict=True):
        many = len(of_part) > CALLS_IN_WORDS
        words = {id(call): str(next(numbers)) if many else _words_of(call, moments) for call in of_part}
        _draw_part(axes, shown, part, [(call, moments[call.rule], words[id(call)]) for call in of_part], metre)
        axes.set(xlim=(box[0], box[2]), ylim=(box[1], box[3]), aspect="equal")
        axes.set_xlabel("y, m" if shown.turned else "x, m")
        if part.round:
            axes.set_title(f"{shown.game.round_word.capitalize()} {part.round}{part.words}", fontsize=11)
    panels[0].set_ylabel("x, m" if shown.turned else "y, m")
    if shown.turned:
        panels[0].yaxis.set_major_formatter(lambda value, _: f"{-value + 0.0:g}")
    if title:
        figure.suptitle(title, fontsize=14, fontweight="bold", x=0.01, horizontalalignment="left")
    figure.legend(
        handles=handles, loc="outside right upper", frameon=False, fontsize=9, handlelength=2.6, ncols=columns
    )
    write_whole(out_png, png_of(figure, bbox_inches="tight", pad_inches=0.15))
    if flown := {name: track for name, track in tracks.items() if track.z.size}:
        write_whole(out_png.with_name(HEIGHTS), png_of(heights(flown, shown.game), bbox_inches="tight"))


@dataclass(frozen=True)
class Plotted:
    """Everything that is drawn.

    Args:
        tracks: by player. zones: by round. bodies: see `vrg.recording.reader.Setting`.
        turned: it is a quarter turn clockwise about the origin.
    """

    game: Game
    tracks: Mapping[str, RobotPoses]
    calls: Sequence[RecordedCall]
    zones: Mapping[int, Sequence[Zone]]
    objects: Sequence[FieldObject]
    bodies: Sequence[tuple[int, float, FieldObject]]
    obstacles: Sequence[Region]
    thoughts: Thoughts
    turned: bool = False

    @property
    def extent(self) -> Bounds:
        """The bounds of it, with a margin, m."""
        played = [_played(track, 0) for track in self.tracks.values()]
        xs = np.concatenate([track.x[keep] for track, keep in zip(self.tracks.values(), played, strict=True)])
        ys = np.concatenate([track.y[keep] for track, keep in zip(self.tracks.values(), played, strict=True)])
        driven = (float(xs.min()), float(ys.min()), float(xs.max()), float(ys.max()))
        every = [zone.region.bounds for of_round in self.zones.values() for zone in of_round]
        x_min, y_min, x_max, y_max = surrounding([driven, *every])
        return x_min - 0.7, y_min - 0.7, x_max + 0.7, y_max + 0.7

    def as_in_windows(self) -> "Plotted":
        """The same, turned where windows turn it."""
        if not fit(self.extent, (0, 0, 1600, 900)).turned:
            return self
        return Plotted(
            game=self.game,
            tracks={name: replace(track, x=track.y, y=-track.x) for name, track in self.tracks.items()},
            calls=[structs.replace(c, poses=tuple(Pose(p.y, -p.x, p.theta) for p in c.poses)) for c in self.calls],
            zones={
                number: [structs.replace(zone, region=_turned(zone.region)) for zone in of_round]
                for number, of_round in self.zones.items()
            },
            objects=[_thing_turned(thing) for thing in self.objects],
            bodies=[(number, time, _thing_turned(thing)) for number, time, thing in self.bodies],
            obstacles=[_turned(region) for region in self.obstacles],
            thoughts=self.thoughts.turned(),
            turned=True,
        )


def _turned(region: Region) -> Region:
    """A region a quarter turn clockwise about the origin."""
    return Outlined(tuple((y, -x) for x, y in region.outline()))


def _thing_turned(thing: FieldObject) -> FieldObject:
    return structs.replace(thing, x=thing.y, y=-thing.x, heading=wrap(thing.heading - math.pi / 2))


def _draw_part(
    axes: Axes, shown: Plotted, part: "MatchPart", calls: Sequence[tuple[RecordedCall, Moment, str]], metre: float
) -> None:
    """Draw a panel; `calls` are those of it that are marked, with the words beside them."""
    here, colours = shown.zones.get(part.round, ()), _colours(shown.tracks, part, shown.game)
    labels = Labels(metre, shown.extent)
    flags = [_thing(thing, shown.game) for thing in shown.objects if not thing.is_body]
    ways = _ways(shown, part)
    last = [_thing(way[-1], shown.game) for way in ways.values()]
    draw_figures(axes, [*look.ground(shown.game, here, shown.obstacles, PAPER), *flags, *last], labels)
    for flag in flags:
        labels.keep_clear((flag.at.x, flag.at.y), width=14.0, height=20.0)
    for zone in here:
        if zone.kind == "field":
            labels.keep_off(zone.region.outline())
    for way in ways.values():
        x, y = _in_pieces(np.array([body.x for body in way]), np.array([body.y for body in way]))
        axes.plot(x, y, color=rgb(_style(way[-1], shown.game).colour), linewidth=0.9, zorder=2.5)
    for track in shown.tracks.values():
        ends = np.flatnonzero(part.shows(track))
        for end in (0, -1) if ends.size else ():
            labels.keep_clear((float(track.x[ends[end]]), float(track.y[ends[end]])))
    for name, track in shown.tracks.items():
        _draw_track(axes, track, part, colours[name], labels, shown.game)
    for call, _, _ in calls:
        labels.keep_clear((call.poses[0].x, call.poses[0].y), width=17.0, height=17.0)
    shown.thoughts.draw_sightings(axes, colours, part.begin, part.end)
    for call, moment, words in calls:
        shown.thoughts.draw_at(axes, call, moment, colours, labels)
        _draw_call(axes, call, moment.sign, words, labels)


def _moments(game: Game, calls: Sequence[RecordedCall]) -> Mapping[str, Moment]:
    """The rules whose calls are marked."""
    if game is not UNKNOWN_GAME:
        return game.marked
    return {call.rule: Moment("X", call.rule.replace("_", " ")) for call in calls if call.poses}


@dataclass(frozen=True)
class MatchPart:
    """The part of a match that a panel shows.

    Args:
        round: its number; 0 stands for all that was played, or all there is, where no round was ever recorded.
        begin, end: match time, s. words: which part of the round it is; empty if it is all.
    """

    round: int
    begin: float
    end: float
    words: str = ""

    def shows(self, track: RobotPoses) -> npt.NDArray[np.bool_]:
        """A mask of the samples of a track that belong to it."""
        within = (track.times >= self.begin - _NEARLY) & (track.times < self.end - _NEARLY)
        return _played(track, self.round) & within

    def has(self, call: RecordedCall) -> bool:
        """True if a call was made in it."""
        in_round = self.round in (call.round, 0) or call.round == 0
        return in_round and (not self.words or self.begin - _NEARLY < call.time <= self.end + _NEARLY)


def _parts(tracks: Mapping[str, RobotPoses]) -> list[MatchPart]:
    """The parts of the match, each of at most PART seconds where that makes no more than MAX_PANELS of them."""
    played = {int(n) for track in tracks.values() for n in np.unique(track.rounds[track.playing])}
    clocks = {number: _clock(tracks, number) for number in sorted(played) or [0]}
    each = max(PART, sum(float(clock[-1]) for _, clock in clocks.values()) / MAX_PANELS)
    parts = []
    for number, (times, clock) in clocks.items():
        count = max(1, math.ceil(float(clock[-1]) / each - 0.2))
        step = float(clock[-1]) / count
        for index in range(count):
            since, until = index * step, (index + 1) * step
            words = f", {clock_text(since)} to {clock_text(until)}" if count > 1 else ""
            begin, end = (float(np.interp(at, clock, times)) for at in (since, until))
            parts.append(MatchPart(number, begin, math.inf if index == count - 1 else end, words))
    return parts


def _figure(count: int, box: Bounds, legend: float = 2.0) -> tuple[Figure, list[Axes], float]:
    """The figure, its panels, and the length of a metre in points.

    Args:
        count: the number of panels. box: what each of them shows, m. legend: the width of the legend, inches.
    """
    aspect = (box[3] - box[1]) / (box[2] - box[0])
    columns = min(count, 2 if count <= 4 else 3 if count <= 9 else 4)
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


def _played(track: RobotPoses, number: int) -> npt.NDArray[np.bool_]:
    """A mask of the samples of a round; 0 = all that were played, or all there are."""
    if not track.playing.any() and number == 0:
        return np.ones(track.times.shape, dtype=np.bool_)
    return track.playing & (track.rounds == number) if number else track.playing


def _clock(tracks: Mapping[str, RobotPoses], number: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The match times at which a round was played, and how long it had been played until then, both in s."""
    times = np.unique(np.concatenate([track.times[_played(track, number)] for track in tracks.values()]))
    if not times.size:
        return np.zeros(1), np.zeros(1)
    steps = np.diff(times, prepend=times[:1])
    return times, np.cumsum(np.where(steps > HALT, 0.0, steps))


def _ways(shown: Plotted, part: MatchPart) -> dict[str, list[FieldObject]]:
    """Each body, such as a ball, again and again as it was seen in a part, by name."""
    ways: dict[str, list[FieldObject]] = {}
    for number, time, body in shown.bodies:
        if part.round in (number, 0) and part.begin - _NEARLY <= time < part.end - _NEARLY:
            ways.setdefault(body.name, []).append(body)
    return ways


def _thing(thing: FieldObject, game: Game) -> Drawn:
    turned = [compose(Pose(0.0, 0.0, thing.heading), Pose(x, y, 0.0)) for x, y in thing.corners]
    at, outline = Pose(thing.x, thing.y, 0.0), [(corner.x, corner.y) for corner in turned]
    return look.thing(thing.name, at, _style(thing, game), PAPER, radius=thing.radius, corners=outline)


def _style(thing: FieldObject, game: Game) -> ThingStyle:
    return game.thing_style(thing.kind, thing.team or "")


def _in_pieces(x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], ...]:
    """A way with a gap where something was placed elsewhere, or the recording has a gap: no line joins the pieces."""
    breaks = np.flatnonzero(np.hypot(np.diff(x), np.diff(y)) > JUMP) + 1
    return np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan)


def _draw_track(axes: Axes, track: RobotPoses, part: MatchPart, colour: Colour, labels: Labels, game: Game) -> None:
    keep = np.flatnonzero(part.shows(track))
    if not keep.size:
        return
    x, y = track.x[keep], track.y[keep]
    line_x, line_y = _in_pieces(x, y)
    style = (0, (4, 1.6)) if track.physical else "-"
    axes.plot(line_x, line_y, color=colour, linestyle=style, linewidth=1.7, zorder=3, solid_capstyle="round")
    axes.plot(x[0], y[0], "o", color=colour, markerfacecolor="white", markersize=6, markeredgewidth=1.6, zorder=4)
    last = _last_sample(track, part, int(keep[-1]))
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


def _draw_call(axes: Axes, call: RecordedCall, sign: str, words: str, labels: Labels) -> None:
    here = (call.poses[0].x, call.poses[0].y)
    axes.plot(*here, sign, color="none", markeredgecolor="black", markersize=15, markeredgewidth=1.2, zorder=6)
    labels.write(axes, words, here, (0.0, 0.0, 0.0), bold=False)


def _words_of(call: RecordedCall, moments: Mapping[str, Moment]) -> str:
    """The player, the time and the others who took part: `nemo 0:09.0 by bruce`."""
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
    tracks: Mapping[str, RobotPoses], parts: Sequence[MatchPart], calls: Sequence[RecordedCall], game: Game
) -> Iterator[Line2D]:
    both = {track.physical for track in tracks.values()} == {True, False}
    whole = MatchPart(0, -math.inf, math.inf)
    for name, colour in _colours(tracks, whole, game).items():
        track = tracks[name]
        roles = list(dict.fromkeys(role for role, playing in zip(track.roles, track.playing, strict=True) if playing))
        label = f"{name} ({', then '.join(roles)})" if roles else name
        yield Line2D([], [], color=colour, linestyle="--" if track.physical else "-", linewidth=2, label=label)
    grey = "0.35"
    if both:
        yield Line2D([], [], color=grey, linestyle="--", label="physical robot")
    yield Line2D([], [], color=grey, marker="o", markerfacecolor="white", linestyle="", label="start")
    ends = [
        (track.roles[last], track.states[last])
        for track in tracks.values()
        for part in parts
        for last in [_last_sample(track, part, int(i)) for i in np.flatnonzero(part.shows(track))[-1:]]
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


def _last_sample(track: RobotPoses, part: MatchPart, shown: int) -> int:
    """The last sample of a part: the tag that ends a round is known only after the last sample of play."""
    if not math.isinf(part.end):
        return shown
    of_round = np.flatnonzero(track.rounds == part.round)
    return int(of_round[-1]) if of_round.size else shown


def _colours(tracks: Mapping[str, RobotPoses], part: MatchPart, game: Game) -> dict[str, Colour]:
    """The colour of each player in a panel: that of the role in which it begins there, in a shade of its own.

    The shade is by its place among those that began the match in its role, so it is the same in all panels.
    """
    whole = MatchPart(0, -math.inf, math.inf)
    first = {name: _first_role(track, whole) for name, track in tracks.items()}
    found = {}
    for name, track in tracks.items():
        alike = [other for other, its in first.items() if its == first[name]]
        rank = alike.index(name) / (len(alike) - 1) if len(alike) > 1 else 0.5
        ground, share = (INK, 0.55 * (1 - 2 * rank)) if rank < 0.5 else (WHITE, 0.45 * (2 * rank - 1))
        found[name] = rgb(mix(game.style(_first_role(track, part)).colour, ground, share))
    return found


def _first_role(track: RobotPoses, part: MatchPart) -> str:
    """The role in which a player begins a part; empty if it is not in it."""
    shown = np.flatnonzero(part.shows(track))
    return track.roles[int(shown[0])] if shown.size else ""


def _natural(name: str) -> tuple[tuple[str, int], ...]:
    """A key that puts p2 before p10: each piece of text with the number that follows it."""
    return tuple((text, int(number or 0)) for text, number in re.findall(r"(\D*)(\d*)", name))
