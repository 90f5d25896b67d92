"""The parts of the field that stand still: ground, zones, walls, obstacles and places of flags, as coloured solids."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from vrg.bus.messages import LARGE_ZONES, Zone
from vrg.colours import Rgb
from vrg.games import game_of
from vrg.games.game import Game
from vrg.regions import Circle, Rectangle, Region
from vrg.types import Vector
from vrg.ui import palette
from vrg.ui.scene import Scene
from vrg.ui.three.shapes import Mesh, band, joined, prism, rounded, sheet, strip
from vrg.ui.zones import zone_look

WALL: Final = 0.55
"""m; walls are shown lower than they are, so that one sees over them."""
LAYER: Final = 0.004
"""m between surfaces that lie upon each other, so that none shines through."""
AROUND: Final = 120.0
"""m of ground around everything."""
EARTH: Final[Rgb] = palette.mix(palette.BACKGROUND, palette.CALM, 0.42)
TURF: Final[Rgb] = palette.mix(palette.FIELD, palette.MUTED, 0.3)
"""The field lies in light, so that it is brighter than in flat windows."""


@dataclass(frozen=True)
class Solid:
    """Something that does not move.

    Args:
        name: its own. casts: it casts a shadow.
    """

    name: str
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


def extent(scene: Scene) -> Extent:
    """The field with all its zones, and where robots began; without zones all that is known."""
    boxes = [zone.region.bounds for zone in scene.zones] or [region.bounds for region in scene.obstacles]
    boxes += [(x, y, x, y) for x, y in scene.starts]
    if not boxes:
        return Extent(0.0, 0.0, 10.0, 10.0)
    x_min, y_min = min(box[0] for box in boxes), min(box[1] for box in boxes)
    x_max, y_max = max(box[2] for box in boxes), max(box[3] for box in boxes)
    return Extent((x_min + x_max) / 2, (y_min + y_max) / 2, max(4.0, x_max - x_min), max(4.0, y_max - y_min))


def ground(scene: Scene) -> list[Solid]:
    """All that stands still, from the ground upwards."""
    place, game = extent(scene), game_of(scene.game)
    plain = [(place.x + x, place.y + y) for x, y in rounded(place.length + 2 * AROUND, place.width + 2 * AROUND, 20.0)]
    found = [Solid("earth", sheet(plain, -3 * LAYER), EARTH)]
    fields = [zone.region for zone in scene.zones if zone.kind == "field"]
    for number, region in enumerate(fields):
        outline = region.outline()
        found.append(Solid(f"field/{number}", sheet(outline, 0.0), TURF))
        found.append(Solid(f"border/{number}", band(outline, -0.09, LAYER), palette.BORDER))
    # Where there is no field, lines on what there is give a feeling for lengths.
    lined = fields or [zone.region for zone in scene.zones] or [Rectangle(*_bounds(place))]
    lines = joined(piece for region in lined for piece in _grid(region))
    found.append(Solid("lines", lines, palette.mix(TURF, palette.TEXT, 0.12)))
    others = [zone for zone in scene.zones if zone.kind != "field"]
    for number, zone in enumerate(others):
        found += _zone(zone, game, f"zone/{number}", 1 if zone.kind in LARGE_ZONES else 4)
    walls = [region.outline() for region in scene.obstacles]
    found.append(Solid("walls", joined(prism(line, 0.0, WALL) for line in walls), palette.WALL, casts=True))
    found.append(Solid("copings", joined(_coping(region) for region in scene.obstacles), palette.WALL_EDGE, casts=True))
    return [solid for solid in found if len(solid.mesh.faces)]


def _bounds(place: Extent) -> tuple[float, float, float, float]:
    along, across = place.length / 2, place.width / 2
    return place.x - along, place.y - across, place.x + along, place.y + across


def _coping(region: Region) -> Mesh:
    return prism(region.outline(), WALL, WALL + 0.05, 0.02)


def _grid(region: Region) -> Iterator[Mesh]:
    """A thin line at each whole metre."""
    x_min, y_min, x_max, y_max = region.bounds
    outline = region.outline()
    for normal, low, high in (((1.0, 0.0), x_min, x_max), ((0.0, 1.0), y_min, y_max)):
        for metre in range(math.ceil(low), math.floor(high) + 1):
            piece = strip(outline, normal, metre - 0.012, metre + 0.012)
            if piece:
                yield sheet(piece, 4.5 * LAYER)


def _zone(zone: Zone, game: Game, name: str, layer: int) -> Iterator[Solid]:
    look, outline, z = zone_look(zone, game), zone.region.outline(), layer * LAYER
    strong = look.safe or isinstance(zone.region, Circle)
    # The tint of the flat windows, upon the brighter ground of this one.
    yield Solid(name, sheet(outline, z), palette.mix(TURF, look.edge, 0.4 if strong else 0.2 if zone.team else 0.08))
    if look.safe:
        yield Solid(f"{name}/stripes", joined(_stripes(outline)).moved(z=z + LAYER), palette.mix(TURF, look.edge, 0.62))
    yield Solid(f"{name}/edge", band(outline, 0.08 if strong else 0.05, z + 2 * LAYER), look.edge)


def _stripes(outline: list[Vector]) -> Iterator[Mesh]:
    """Diagonal stripes over an outline."""
    c = math.sqrt(0.5)
    along = [c * x + c * y for x, y in outline]
    for step in range(math.floor(min(along)), math.ceil(max(along))):
        piece = strip(outline, (c, c), step, step + 0.45)
        if piece:
            yield sheet(piece, 0.0)
