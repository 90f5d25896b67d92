"""The look of what lies on a field, as figures: zones, walls, robots, flags, marks and the strokes of players.

What a game shows is decided here alone: every window, the page, plots and recordings draw these figures.
"""

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Final

from vrg.bus.messages import LARGE_ZONES, Zone
from vrg.colours import DARK, Rgb, Theme, mix
from vrg.figures import Figure, Label, Shape, Writing, line, pixels, room, rounded, to_millimetres, within
from vrg.games.game import Game, Marker, Style, ThingStyle
from vrg.regions import Circle, Region
from vrg.types import Pose, Vector

SMALLEST: Final = 18.0
"""Pixels; the side of what must be seen is never drawn shorter."""
NOSE: Final = 0.3
"""The length of the nose ahead of a robot, as a part of the robot's length."""
_RIM: Final = 0.12
"""The width of the rim of a physical robot, as a part of its length; that of a virtual one is a third of it."""
WALL_HEIGHT: Final = 1.0
"""The height with which walls without an upper end are drawn, m: `vrg.hal.sim.map.WALL_HEIGHT`."""
SHADOW: Final = 0.6
"""How far a shadow lies to the right of what is in the air, and below it on the map, in lengths of it for each metre of
its height: it is drawn larger than it is where it would be too small to see, and so is the way to its shadow."""
_WIDE: Final = 0.75
"""The width of a large letter, as a part of its height, on average."""
_LINES: Final = 60
"""The most lines of a grid along one side."""
_LARGE: Final = 0.5
"""m; letters of a name that are so large are large enough."""
_STRIPES: Final = 0.45
"""m between the stripes of a safe zone, of which there are at most a few dozen."""
_CORNERS: Final[dict[Marker, tuple[Vector, ...]]] = {
    Marker.TRIANGLE: ((1.3, 0.0), (-0.9, 0.85), (-0.9, -0.85)),
    Marker.SQUARE: ((0.8, 0.8), (-0.8, 0.8), (-0.8, -0.8), (0.8, -0.8)),
    Marker.DIAMOND: ((1.1, 0.0), (0.0, 0.9), (-1.1, 0.0), (0.0, -0.9)),
    Marker.CROSS: (
        (0.3, 0.0), (0.95, 0.65), (0.65, 0.95), (0.0, 0.3), (-0.65, 0.95), (-0.95, 0.65),
        (-0.3, 0.0), (-0.95, -0.65), (-0.65, -0.95), (0.0, -0.3), (0.65, -0.95), (0.95, -0.65),
    ),
}  # fmt: skip
"""The outlines of the signs about a circle of radius 1; they point along x, counter-clockwise."""


def ground(game: Game, zones: Sequence[Zone], obstacles: Iterable[Region], theme: Theme = DARK) -> list[Figure]:
    """What stands still, from the ground upwards: fields with their grids, zones, borders and walls."""
    fields = [zone for zone in zones if zone.kind == "field"]
    found = [
        Figure(f"field {zone.name}", (Shape(_outline(zone.region), theme.field), *grid(zone.region, theme)))
        for zone in fields
    ]
    found += [_zone(zone, game, theme) for zone in zones if zone.kind != "field"]
    for zone in fields:
        border = Shape(_outline(zone.region), line=theme.border, width=2.5)
        found.append(Figure(f"border {zone.name}", (border,)))
    for number, region in enumerate(obstacles):
        height = WALL_HEIGHT if region.z_max is None else region.z_max
        fill = theme.wall if region.z_max is None else mix(theme.wall, theme.field, 0.5)  # something may pass above it
        wall = Shape(_outline(region), fill, theme.wall_edge, 1.5, height=height)
        found.append(Figure(f"wall {number}", (wall,)))
    return found


def _outline(region: Region) -> tuple[Vector, ...]:
    return to_millimetres(region.outline())


def grid(region: Region, theme: Theme = DARK) -> tuple[Shape, ...]:
    """A line at each whole metre, as far as it is inside the region; on large fields at each tenth or hundredth."""
    x_min, y_min, x_max, y_max = region.bounds
    step = 10 ** max(0, math.ceil(math.log10(max(x_max - x_min, y_max - y_min, 1.0) / _LINES)))
    sides = (x_min, x_max), (y_min, y_max)
    xs, ys = (range(step * math.ceil(low / step), math.floor(high) + 1, step) for low, high in sides)
    ways: list[tuple[Vector, Vector]] = [((x, y_min), (x, y_max)) for x in xs]
    ways += [((x_min, y), (x_max, y)) for y in ys]
    inside = (within(region, start, end) for start, end in ways)
    return tuple(line(*ends, colour=theme.grid) for ends in inside if ends is not None)


def _zone(zone: Zone, game: Game, theme: Theme) -> Figure:
    """A zone: a safe one is striped and stands out, and that of a team has the team's colour."""
    safe, large = zone.kind == "safe", zone.kind in LARGE_ZONES
    colour = theme.safe if safe else game.team_style(zone.team).colour if zone.team else theme.muted
    # A grey zone must not look like a wall.
    tint = mix(theme.field, colour, 0.2 if safe else 0.08 if large else 0.14 if zone.team else 0.06)
    outline = _outline(zone.region)
    stripes = _stripes(zone.region, mix(tint, colour, 0.22)) if safe else ()
    edge = Shape(outline, line=mix(colour, theme.field, 0.25), width=2.0 if safe else 1.0)
    return Figure(f"zone {zone.name}", (Shape(outline, tint), *stripes, edge), writing=_name(zone, theme))


def _stripes(region: Region, colour: Rgb) -> Iterable[Shape]:
    """Diagonal lines, as far as they are inside the region."""
    x_min, y_min, x_max, y_max = region.bounds
    high, far = y_max - y_min, x_max - x_min + y_max - y_min
    step = max(_STRIPES, far / 60)
    starts = (x_min - high + step * k for k in range(math.ceil(far / step)))
    inside = (within(region, (x, y_min), (x + high, y_max)) for x in starts)
    return (line(*ends, colour=colour, width=2.0) for ends in inside if ends is not None)


def _name(zone: Zone, theme: Theme) -> Writing | None:
    """The name of a zone about its middle, in one line, or in two where that gives larger letters.

    A large zone has none, which would lie below those of the zones in it.
    """
    safe, words = zone.kind == "safe", zone.name.replace("_", " ").upper()
    if zone.kind in LARGE_ZONES or not words.strip():
        return None
    words += " ZONE" if safe and "ZONE" not in words else ""
    space, drop = room(zone.region), 0.0
    if zone.team and isinstance(zone.region, Circle):
        # In its middle there may be an object.
        radius = zone.region.radius
        space, drop = (1.6 * radius, 0.62 * radius), 0.55 * radius
    parts = words.split()
    tried = [((" ".join(parts[:k]), " ".join(parts[k:])) if k else (words,)) for k in range(len(parts))]
    lines = max(tried, key=lambda lines: min(_LARGE, max(_largest(lines, space))) / (1.0 if len(lines) == 1 else 1.2))
    along = _largest(lines, space)
    ink = mix(theme.safe, theme.text, 0.45) if safe else theme.muted
    return Writing(lines, zone.region.middle, ink, 20.0 if safe else 15.0, along, drop)


def _largest(lines: Sequence[str], space: Vector) -> Vector:
    """The largest letters with which lines have room if they run along x, and along y, m."""
    wide, high = _WIDE * max(1, *map(len, lines)) / 0.9, 1.25 * len(lines) / 0.9
    along, across = (round(min(a / wide, b / high), 3) for a, b in (space, space[::-1]))
    return along, across


def marker(sign: Marker, radius: float, colour: Rgb, *, up: bool = False) -> Shape:
    """The sign of a role, about as large as a circle. A cross does not turn, because turned it could be a plus.

    Args:
        radius: of the circle. up: it points along y in place of x.
    """
    if sign is Marker.CIRCLE:
        return Shape(((0.0, 0.0),), colour, radius=round(0.85 * radius, 3))
    corners = to_millimetres((x * radius, y * radius) for x, y in _CORNERS[sign])
    if up:
        corners = tuple((-y, x) for x, y in corners)
    return Shape(corners, colour, still=up or sign is Marker.CROSS)


def badge(style: Style) -> tuple[Shape, ...]:
    """The sign of a role upon its colour, in a square of side 1 about the origin."""
    return Shape(rounded(1.0, 1.0, 0.25), style.colour, still=True), marker(style.marker, 0.32, DARK.ink, up=True)


@lru_cache(512)
def _body(style: Style, length: float, width: float, physical: bool) -> tuple[Shape, ...]:
    rim, edge = (_RIM, DARK.text) if physical else (_RIM / 3, DARK.ink)
    rim *= length
    nose = ((length * (0.5 + NOSE) + rim, 0.0), (length / 2, 0.36 * width), (length / 2, -0.36 * width))
    outlines: list[tuple[tuple[Vector, ...], Rgb]] = [
        (nose, mix(style.colour, DARK.text, 0.75)),
        (rounded(length + 2 * rim, width + 2 * rim, 0.12 * width + rim), edge),
        (rounded(length, width, 0.12 * width), style.colour),
    ]
    body = [Shape(to_millimetres(outline), colour) for outline, colour in outlines]
    return (*body, marker(style.marker, 0.33 * width, DARK.ink))


def robot(name: str, at: Pose, style: Style, size: Vector, *, physical: bool, label: Label | None = None) -> Figure:
    """A robot from above, with a nose and the sign of its role. The rim of a physical one is light.

    Args:
        size: its length and width, m.
    """
    return Figure(f"robot {name}", _body(style, *size, physical), at, _least(size), label=label)


def shadow(name: str, at: Pose, size: Vector) -> Figure:
    """The shadow of a robot in the air on the ground, the farther from the robot the higher that is.

    Args:
        at: the pose of the robot. size: its length and width, m.
    """
    away = round(SHADOW * at.z * size[0], 3)
    ground = Shape(((away, -away),), mix(DARK.field, DARK.ink, 0.6), radius=round(min(size) / 2, 3))
    return Figure(f"shadow of {name}", (ground,), Pose(at.x, at.y, 0.0), _least(size))


def _least(size: Vector) -> float:
    """The pixels per m with which a robot is drawn at least."""
    return SMALLEST / max(size[0], 0.001)


def reach(size: Vector) -> float:
    """The radius of the circle about a robot in which its corners and its nose are, m."""
    return round(max(math.hypot(*size) / 2 + _RIM * size[0], size[0] * (0.5 + NOSE + _RIM)), 3)


def trail(colour: Rgb, points: tuple[Vector, ...] = ()) -> Shape:
    """The way that a robot has driven lately."""
    now, before = _ways(colour)
    return Shape(points, line=now, width=3.0, closed=False, faded=before)


@lru_cache(128)
def _ways(colour: Rgb) -> tuple[Rgb, Rgb]:
    return mix(DARK.field, colour, 0.9), mix(DARK.field, colour, 0.2)


def mark(name: str, at: Pose, colour: Rgb) -> Figure:
    """The place where a player lines up, in the colour of its role."""
    tint, box = mix(colour, DARK.field, 0.45), ((0.25, 0.2), (0.25, -0.2), (-0.25, -0.2), (-0.25, 0.2))
    shapes = (Shape(box, line=tint, width=1.5), line((0.25, 0.0), (0.425, 0.0), colour=tint, width=1.5))
    return Figure(f"mark {name}", shapes, at, 2 * SMALLEST)


def thing(
    name: str,
    at: Pose,
    style: ThingStyle,
    theme: Theme = DARK,
    *,
    radius: float = 0.0,
    corners: Sequence[Vector] = (),
    lost: bool = False,
) -> Figure:
    """A thing of the game with a light rim, so that it is seen upon anything: its form, or a flag if it has none.

    Args:
        radius: of a disc, m. corners: of an outline about its place, m.
        lost: a body is not seen, so that there is only its outline, in its colour.
    """
    colour = style.colour
    if radius or corners:
        points = ((0.0, 0.0),) if radius else to_millimetres(corners)
        fill, rim = (None, colour) if lost else (colour, theme.border)
        body = Shape(points, fill, rim, 1.5, radius=round(radius, 3), height=style.height)
        across = 2 * (radius or max(math.hypot(x, y) for x, y in corners))
        return Figure(f"object {name}", (body,), at, SMALLEST / 2 / across)
    shapes = (
        Shape(((0.0, 0.0), (0.0, 0.5)), line=theme.border, width=2.5, closed=False, still=True),
        Shape(((0.0, 0.5), (0.375, 0.375), (0.0, 0.25)), colour, theme.border, still=True),
        Shape(((0.0, 0.0),), theme.border, radius=0.05, still=True),
    )
    return Figure(f"object {name}", shapes, Pose(at.x, at.y, 0.0), 2 * SMALLEST, clear=0.5)


def stroke(name: str, points: tuple[Vector, ...], label: str, colour: Rgb) -> list[Figure]:
    """A dot or a line with a dot at its end that a player wants to be shown, with words beside the dot."""
    tint = mix(DARK.field, colour, 0.75)
    dot = Shape(((0.0, 0.0),), tint, radius=2.0 if len(points) == 1 else 3.5)
    words = Label(label, DARK.text, size=12.0, bold=False) if label else None
    end = pixels(f"end of {name}", Pose(*points[-1], 0.0), dot, label=words)
    way = Figure(name, (line(*points, colour=tint, width=1.5),))
    return [way, end] if len(points) > 1 else [end]


def flash(number: int, at: Vector, word: str, share: float) -> Figure:
    """A ring that grows and thins about what was called, with a word for it.

    Args:
        number: which of those that are shown. share: how much of its time is over, 0 to 1.
    """
    radius, thin = round(0.6 * (1.0 + share), 3), 1.0 - 0.8 * share
    rings = ((radius, 4.0), (0.75 * radius, 3.0))
    shapes = tuple(Shape(((0.0, 0.0),), line=DARK.caution, width=width * thin, radius=r) for r, width in rings)
    label = Label(word.upper(), DARK.ink, plate=DARK.caution, size=18.0, reach=0.75)
    return Figure(f"call {number}", shapes, Pose(*at, 0.0), SMALLEST / 0.6, 60.0 / 0.6, label=label)


def around(name: str, at: Pose, size: Vector) -> Figure:
    """The ring about a robot that a person drives."""
    ring = Shape(((0.0, 0.0),), line=DARK.caution, width=2.5, radius=round(reach(size) + 0.1, 3))
    return Figure(f"ring {name}", (ring,), at, _least(size))
