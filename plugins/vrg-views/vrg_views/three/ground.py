"""The parts of the field that stand still: ground, zones, walls and obstacles, as coloured solids."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from vrg.colours import DARK, Rgb, mix
from vrg.figures import Figure, rounded
from vrg.games import game_of, look
from vrg.regions import Bounds, Rectangle, surrounding
from vrg.types import Vector
from vrg.ui import palette
from vrg.ui.labels import overlap
from vrg.ui.scene import Scene
from vrg_views.three.shapes import Mesh, band, joined, prism, sheet

SHOWN: Final = 0.55
"""Walls are shown lower than they are by this factor, so that one sees over them."""
LAYER: Final = 0.003
"""m between surfaces that lie upon each other, so that none shines through."""
LEVELS: Final = 4
"""The most figures that lie upon each other in layers of their own; below what moves, which lies upon all."""
METRES: Final = 0.035
"""The width in m of a line that is a pixel wide in a window."""
AROUND: Final = 120.0
"""m of ground around everything."""
EARTH: Final[Rgb] = mix(palette.BACKGROUND, palette.CALM, 0.42)
TURF: Final[Rgb] = mix(palette.FIELD, palette.MUTED, 0.3)
"""The field lies in light, so that it is brighter than in flat windows."""
LIT: Final = replace(DARK, field=TURF, grid=mix(TURF, palette.TEXT, 0.12))


@dataclass(frozen=True)
class Solid:
    """Something that does not move.

    Args:
        casts: it casts a shadow.
    """

    mesh: Mesh
    colour: Rgb
    casts: bool = False


@dataclass(frozen=True)
class Extent:
    """The part of the world that is worth looking at.

    Args:
        x, y: its middle, m. length, width: along x and y, m.
    """

    x: float
    y: float
    length: float
    width: float

    @property
    def region(self) -> Rectangle:
        """The same as a region."""
        along, across = self.length / 2, self.width / 2
        return Rectangle(self.x - along, self.y - across, self.x + along, self.y + across)


def extent(scene: Scene) -> Extent:
    """The field with all its zones, and where robots began; without zones all that is known."""
    boxes = [zone.region.bounds for zone in scene.zones] or [region.bounds for region in scene.obstacles]
    boxes += [(x, y, x, y) for x, y in scene.starts]
    if not boxes:
        return Extent(0.0, 0.0, 10.0, 10.0)
    x_min, y_min, x_max, y_max = surrounding(boxes)
    return Extent((x_min + x_max) / 2, (y_min + y_max) / 2, max(4.0, x_max - x_min), max(4.0, y_max - y_min))


def ground(scene: Scene) -> list[Solid]:
    """All that stands still, from the ground upwards."""
    place = extent(scene)
    plain = [(place.x + x, place.y + y) for x, y in rounded(place.length + 2 * AROUND, place.width + 2 * AROUND, 20.0)]
    meshes: dict[tuple[Rgb, bool], list[Mesh]] = {(EARTH, False): [sheet(plain, -3 * LAYER)]}
    below: list[tuple[Bounds, int]] = []
    figures = look.ground(game_of(scene.game), scene.zones, scene.obstacles, LIT)
    if not any(zone.kind == "field" for zone in scene.zones):
        # Lines on what there is give a feeling for lengths.
        lined = [zone.region for zone in scene.zones] or [place.region]
        figures.append(Figure("lines", tuple(line for region in lined for line in look.grid(region, LIT))))
    for figure in figures:
        box = surrounding((x, y, x, y) for shape in figure.shapes for x, y in shape.points)
        level = min(LEVELS, 1 + max((level for other, level in below if overlap(box, other)), default=-1))
        below.append((box, level))
        for colour, casts, mesh in _solids(figure, level):
            meshes.setdefault((colour, casts), []).append(mesh)
    return [Solid(joined(of_colour), colour, casts) for (colour, casts), of_colour in meshes.items()]


def _solids(figure: Figure, level: int) -> Iterator[tuple[Rgb, bool, Mesh]]:
    """The parts of a figure with their colours, and whether they cast a shadow: what lies upon what is in layers."""
    for shape in figure.shapes:
        if shape.height and shape.fill is not None and shape.line is not None:
            yield shape.fill, True, prism(shape.points, 0.0, SHOWN * shape.height)
            yield shape.line, True, prism(shape.points, SHOWN * shape.height, SHOWN * shape.height + 0.05, 0.02)
            continue
        if shape.fill is not None:
            yield shape.fill, False, sheet(shape.points, 3 * level * LAYER)
        if shape.line is not None and shape.closed:
            yield shape.line, False, band(shape.points, METRES * shape.width, (3 * level + 2) * LAYER)
        elif shape.line is not None:
            yield shape.line, False, sheet(_strip(shape.points, METRES * shape.width), (3 * level + 1) * LAYER)


def _strip(points: Sequence[Vector], width: float) -> list[Vector]:
    """The outline of a straight line."""
    (ax, ay), (bx, by) = points[0], points[-1]
    share = width / 2 / max(math.hypot(bx - ax, by - ay), 1e-9)
    x, y = (by - ay) * share, (ax - bx) * share
    return [(ax + x, ay + y), (bx + x, by + y), (bx - x, by - y), (ax - x, ay - y)]
