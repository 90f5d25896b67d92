"""A picture as data: figures of polygons, lines, discs and words.

Windows, the page, plots, the view in three dimensions and the recorder's scene draw figures in a loop over them, and
know nothing else of what lies on a field. Lengths are in m; widths and sizes of letters are in pixels of a window of
usual size, because lines and letters must be seen however large a field is.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from msgspec import Struct

from vrg.colours import Rgb
from vrg.portable.scalars import cos_sin
from vrg.regions import Region
from vrg.segments import Stretch
from vrg.types import Pose, Vector

ORIGIN = Pose(0.0, 0.0, 0.0)
ENDLESS = 1e9
"""Pixels per m that no window reaches."""


class Shape(Struct, frozen=True, omit_defaults=True):
    """A polygon, a line, discs or rings.

    Args:
        points: in the frame of its figure, m. radius: m; if it is not 0, a disc or a ring lies about each point.
        fill: the colour inside; None leaves it open. line: the colour of the line; None draws none.
        width: of the line, pixels. closed: the line goes back to the first point.
        faded: the colour and the thinness with which the line begins; it ends as `line` and `width` tell.
        still: it turns neither with its figure nor with the view: y points up in a window, and from the ground
            upwards in three dimensions.
        height: of what stands upon the shape in three dimensions, m; 0 lies on the ground.
    """

    points: tuple[Vector, ...]
    fill: Rgb | None = None
    line: Rgb | None = None
    width: float = 1.0
    closed: bool = True
    radius: float = 0.0
    faded: Rgb | None = None
    still: bool = False
    height: float = 0.0


class Label(Struct, frozen=True, omit_defaults=True):
    """Words beside a figure, where they cover neither each other nor a robot.

    Args:
        words: what is written. short: what stands for the words in a crowd, such as a number; empty if nothing does.
        remark: what follows them in any case. ink: their colour. plate: of the plate behind them; None without one.
        reach: the radius around the figure's place that is left free, m. size: of letters, pixels. bold: or regular.
    """

    words: str
    ink: Rgb
    short: str = ""
    remark: str = ""
    plate: Rgb | None = None
    reach: float = 0.0
    size: float = 13.0
    bold: bool = True


class Writing(Struct, frozen=True, omit_defaults=True):
    """Words painted upon the ground.

    Args:
        lines: one below the other. middle: of them, m. drop: how far below that they stand in a window, m.
        ink: their colour. size: of letters, pixels, where they have room.
        along: the largest letters that have room if the lines run along x, and along y, m.
    """

    lines: tuple[str, ...]
    middle: Vector
    ink: Rgb
    size: float
    along: Vector
    drop: float = 0.0


class Figure(Struct, frozen=True, omit_defaults=True):
    """Shapes that belong together.

    Args:
        name: its own, such as `zone safe`. at: its frame.
        least: pixels per m with which it is drawn at least, so that it can be seen.
        most: pixels per m with which it is drawn at most, in a window of usual size.
        label, writing: words with it. clear: m to the right of its place and above it upon which no words lie.
    """

    name: str
    shapes: tuple[Shape, ...] = ()
    at: Pose = ORIGIN
    least: float = 0.0
    most: float = ENDLESS
    label: Label | None = None
    writing: Writing | None = None
    clear: float = 0.0


def pixels(name: str, at: Pose, *shapes: Shape, label: Label | None = None) -> Figure:
    """A figure whose lengths are pixels of a window of usual size."""
    return Figure(name, shapes, at, least=1.0, most=1.0, label=label)


def to_millimetres(points: Iterable[Vector]) -> tuple[Vector, ...]:
    """Points rounded to a millimetre, which is more than can be seen: figures are sent to browsers as text."""
    return tuple((round(x, 3), round(y, 3)) for x, y in points)


def line(*points: Vector, colour: Rgb, width: float = 1.0) -> Shape:
    """An open line."""
    return Shape(points, line=colour, width=width, closed=False)


def dashes(points: Sequence[Vector], colour: Rgb, width: float, length: float) -> Iterator[Shape]:
    """A line of dashes, each of which is `length` m long with its gap."""
    for start, end in pairwise(points):
        far = math.dist(start, end)
        for index in range(math.ceil(far / length)):
            first, last = (min(1.0, (index + part) * length / far) for part in (0.0, 0.6))
            yield line(*_part(start, end, (first, last)), colour=colour, width=width)


def rounded(length: float, width: float, radius: float) -> tuple[Vector, ...]:
    """A rectangle about the origin with round corners, counter-clockwise."""
    radius = min(radius, length / 2, width / 2)
    arc = [cos_sin(a) for a in (0.0, math.pi / 6, math.pi / 3, math.pi / 2)]
    x, y = length / 2 - radius, width / 2 - radius
    corner = [(x + radius * c, y + radius * s) for c, s in arc]
    half = [*corner, *((-x, y) for x, y in reversed(corner))]
    return (*half, *((-x, -y) for x, y in half))


def within(region: Region, start: Vector, end: Vector) -> tuple[Vector, Vector] | None:
    """The part of a line that is inside a region; None if there is none."""
    stretch = region.inside(start, end)
    return None if stretch is None else _part(start, end, stretch)


def _part(start: Vector, end: Vector, stretch: Stretch) -> tuple[Vector, Vector]:
    (ax, ay), (bx, by) = start, end
    a, b = ((ax + share * (bx - ax), ay + share * (by - ay)) for share in stretch)
    return a, b


def room(region: Region) -> Vector:
    """The room for something centred in the middle of a region: its length along x and along y, m."""
    x, y = region.middle
    x_min, y_min, x_max, y_max = region.bounds

    def reach(dx: float, dy: float) -> float:
        stretch = region.inside((x - dx, y - dy), (x + dx, y + dy))
        return 0.0 if stretch is None else 2 * min(0.5 - stretch[0], stretch[1] - 0.5)

    width, height = x_max - x_min, y_max - y_min
    return 2 * width * reach(width, 0.0), 2 * height * reach(0.0, height)
