"""Maps: walls and obstacles of a flat world, read from TOML.

name = "yard"
bounds = { x_min = -5, y_min = -5, x_max = 5, y_max = 5 }   # any region; no robot can be placed outside of it
origin = { latitude = 35.083, longitude = -106.624 }        # where x = y = 0 is, for GPS; degrees, WGS 84; +y is north
[[wall]]                     # a polyline
points = [[-5, -5], [5, -5]]
thickness = 0.2
[[box]]                      # planters, benches, tables; heading in degrees
x = 1.0
y = 2.0
length = 1.8
width = 0.5
heading = 30.0
height = 0.8                 # above it, what flies passes; walls and obstacles without one have no upper end
[[circle]]                   # columns
x = 3.0
y = 0.0
radius = 0.25
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import Field, ValidationError, model_validator

from vrg.errors import ConfigError, FileError
from vrg.files import read_text
from vrg.hal.sim.maps import MAPS
from vrg.hal.sim.shapes import Box, box_corners, box_edges, boxes_touch, circle_touches
from vrg.portable.scalars import atan2
from vrg.regions import Circle, Polygon, Region
from vrg.tables import RegionSetting, Table, located, parsed, problems_in
from vrg.types import Pose

WALL_HEIGHT = 1.0
"""The height with which walls and obstacles without an upper end are drawn, and behind which satellites are, m."""

_Number = Annotated[float, Field(ge=-1e4, le=1e4)]
_Size = Annotated[float, Field(gt=0.0, le=1e4)]
_Top = _Size | None
"""The height of a wall or an obstacle, m; None for one without an upper end."""


@dataclass(frozen=True)
class Map:
    """The walls and obstacles of a flat world.

    Args:
        name: the name that the map's file gives.
        bounds: the part of the plane in which robots may be placed.
        boxes: walls and box-shaped obstacles. circles: round obstacles.
        origin: the latitude and the longitude of x = y = 0, rad, WGS 84; +x is east and +y is north.
    """

    name: str
    bounds: Region
    boxes: tuple[Box, ...]
    circles: tuple[Circle, ...]
    origin: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def obstacles(self) -> tuple[Polygon | Circle, ...]:
        """The walls and obstacles as regions."""
        return (*(Polygon(tuple(box_corners(box)), z_max=box.z_max) for box in self.boxes), *self.circles)

    @cached_property
    def low(self) -> list[tuple[float, Polygon | Circle]]:
        """The obstacles that have an upper end, each after its height, m."""
        return [(region.z_max, region) for region in self.obstacles if region.z_max is not None]

    def at(self, height: float) -> "Map":
        """The map with what is higher than a height, m, alone; the same one if nothing is lower."""
        if not any(top <= height for top, _ in self.low):
            return self
        boxes = tuple(box for box in self.boxes if box.z_max is None or box.z_max > height)
        circles = tuple(circle for circle in self.circles if circle.z_max is None or circle.z_max > height)
        return replace(self, boxes=boxes, circles=circles)

    @cached_property
    def edges(self) -> npt.NDArray[np.float64]:
        """The outlines of the boxes, counter-clockwise: shape (4 * boxes, 4), x0 y0 x1 y1 in m."""
        return box_edges(np.array([(b.x, b.y, b.heading, b.length, b.width) for b in self.boxes]).reshape(-1, 5))

    @cached_property
    def discs(self) -> npt.NDArray[np.float64]:
        """The round obstacles: shape (circles, 3), x y radius in m."""
        return np.array([(c.x, c.y, c.radius) for c in self.circles], dtype=np.float64).reshape(-1, 3)

    def footprint_clear(self, pose: Pose, length: float, width: float) -> bool:
        """True if a body of this size (m) fits at this pose: inside the bounds, touching no wall or obstacle."""
        body = Box(pose.x, pose.y, pose.theta, length, width)
        # The bounds are convex, so a body is inside if its corners are.
        return (
            all(self.bounds.contains(x, y) for x, y in box_corners(body))
            and not any(boxes_touch(body, box) for box in self.boxes)
            and not any(circle_touches(body, circle) for circle in self.circles)
        )


class _WallEntry(Table):
    points: Annotated[list[tuple[_Number, _Number]], Field(min_length=2)]
    thickness: _Size
    height: _Top = None

    @model_validator(mode="after")
    def _distinct(self) -> "_WallEntry":
        if any(a == b for a, b in zip(self.points, self.points[1:], strict=False)):
            raise ValueError("expected neighbouring points that differ")
        return self

    def boxes(self) -> list[Box]:
        """One box per segment. Each reaches half a thickness beyond its ends, so that corners are closed."""
        found = []
        for (x0, y0), (x1, y1) in zip(self.points, self.points[1:], strict=False):
            length = math.hypot(x1 - x0, y1 - y0) + self.thickness
            heading = atan2(y1 - y0, x1 - x0)
            found.append(Box((x0 + x1) / 2, (y0 + y1) / 2, heading, length, self.thickness, self.height))
        return found


class _BoxEntry(Table):
    x: _Number
    y: _Number
    length: _Size
    width: _Size
    heading: _Number = 0.0
    height: _Top = None


class _CircleEntry(Table):
    x: _Number
    y: _Number
    radius: _Size
    height: _Top = None


class _Origin(Table):
    latitude: Annotated[float, Field(ge=-85.0, le=85.0)]
    longitude: Annotated[float, Field(ge=-180.0, le=180.0)]


class _MapFile(Table):
    name: str
    bounds: RegionSetting
    origin: _Origin = _Origin(latitude=0.0, longitude=0.0)
    wall: list[_WallEntry] = Field(default_factory=list)
    box: list[_BoxEntry] = Field(default_factory=list)
    circle: list[_CircleEntry] = Field(default_factory=list)

    @model_validator(mode="after")
    def _flat(self) -> "_MapFile":
        if (self.bounds.z_min, self.bounds.z_max) != (0.0, None):
            raise ValueError("bounds: expected no z_min and no z_max: a map has no upper end")
        return self


def load_map(name_or_path: str | Path) -> Map:
    """Load an installed map by its name, or any map by the path of its .toml file.

    Raises:
        ConfigError: there is no map of that name, it cannot be read, or its fields are wrong. The error lists all
            problems at once.
    """
    wanted = str(name_or_path)
    path = Path(wanted)
    if not wanted.endswith(".toml"):
        if wanted not in MAPS:
            raise ConfigError(f"{MAPS.unknown(wanted)}, or a path that ends in .toml")
        path = MAPS.get(wanted)
    try:
        text = read_text(path)
    except (OSError, FileError) as error:
        raise ConfigError(f"map: cannot read {path}: {error}") from None
    return _parse(text, str(path))


def _parse(text: str, file: str) -> Map:
    try:
        entry = _MapFile.model_validate(parsed(text, file))
    except ValidationError as error:
        raise ConfigError(located(problems_in(error, _MapFile), file, text)) from None
    boxes = [box for wall in entry.wall for box in wall.boxes()]
    boxes += [Box(b.x, b.y, math.radians(b.heading), b.length, b.width, b.height) for b in entry.box]
    return Map(
        name=entry.name,
        bounds=entry.bounds,
        boxes=tuple(boxes),
        circles=tuple(Circle(c.x, c.y, c.radius, z_max=c.height) for c in entry.circle),
        origin=(math.radians(entry.origin.latitude), math.radians(entry.origin.longitude)),
    )
