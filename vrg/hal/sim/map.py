"""Maps: walls and obstacles of a flat world, read from TOML.

name = "yard"
bounds = { x_min = -5, y_min = -5, x_max = 5, y_max = 5 }   # m; no robot is placed outside
[[wall]]                     # a polyline
points = [[-5, -5], [5, -5]]
thickness = 0.2
[[box]]                      # planters, benches, tables; heading in degrees
x = 1.0
y = 2.0
length = 1.8
width = 0.5
heading = 30.0
[[circle]]                   # columns
x = 3.0
y = 0.0
radius = 0.25
"""

import difflib
import math
import tomllib
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from vrg.bus.messages import Pose
from vrg.errors import ConfigError
from vrg.hal.sim.shapes import Box, Circle, box_edges, boxes_touch, circle_touches

WALL_HEIGHT = 1.0
"""m; every wall and obstacle, so that every laser sees it."""

_Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e4, le=1e4)]
_Size = Annotated[float, Field(allow_inf_nan=False, gt=0.0, le=1e4)]


@dataclass(frozen=True, slots=True)
class Bounds:
    """The part of the plane in which robots may be placed, m."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float


@dataclass(frozen=True)
class Map:
    """A flat world.

    Args:
        boxes: walls and box-shaped obstacles. circles: round obstacles.
    """

    name: str
    bounds: Bounds
    boxes: tuple[Box, ...]
    circles: tuple[Circle, ...]

    @cached_property
    def edges(self) -> npt.NDArray[np.float64]:
        """Outlines of the boxes, counter-clockwise: shape (4 * boxes, 4), x0 y0 x1 y1 in m."""
        return box_edges(np.array([(b.x, b.y, b.heading, b.length, b.width) for b in self.boxes]).reshape(-1, 5))

    @cached_property
    def discs(self) -> npt.NDArray[np.float64]:
        """The round obstacles: shape (circles, 3), x y radius in m."""
        return np.array([(c.x, c.y, c.radius) for c in self.circles], dtype=np.float64).reshape(-1, 3)

    def footprint_clear(self, pose: Pose, length: float, width: float) -> bool:
        """Whether a body of this size (m) fits at this pose: inside the bounds, touching no wall or obstacle."""
        body = Box(pose.x, pose.y, pose.theta, length, width)
        edges = box_edges(np.array([[body.x, body.y, body.heading, length, width]]))
        inside = (
            edges[:, 0].min() >= self.bounds.x_min
            and edges[:, 0].max() <= self.bounds.x_max
            and edges[:, 1].min() >= self.bounds.y_min
            and edges[:, 1].max() <= self.bounds.y_max
        )
        return bool(
            inside
            and not any(boxes_touch(body, box) for box in self.boxes)
            and not any(circle_touches(body, circle) for circle in self.circles)
        )


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _BoundsEntry(_Strict):
    x_min: _Number
    y_min: _Number
    x_max: _Number
    y_max: _Number

    @model_validator(mode="after")
    def _ordered(self) -> "_BoundsEntry":
        if self.x_min >= self.x_max or self.y_min >= self.y_max:
            raise ValueError("expected x_min < x_max and y_min < y_max")
        return self


class _WallEntry(_Strict):
    points: Annotated[list[tuple[_Number, _Number]], Field(min_length=2)]
    thickness: _Size

    @model_validator(mode="after")
    def _distinct(self) -> "_WallEntry":
        if any(a == b for a, b in zip(self.points, self.points[1:], strict=False)):
            raise ValueError("expected neighbouring points that differ")
        return self

    def boxes(self) -> list[Box]:
        """One box a segment; each reaches half a thickness beyond its ends, so that corners are closed."""
        found = []
        for (x0, y0), (x1, y1) in zip(self.points, self.points[1:], strict=False):
            length = math.hypot(x1 - x0, y1 - y0) + self.thickness
            heading = math.atan2(y1 - y0, x1 - x0)
            found.append(Box((x0 + x1) / 2, (y0 + y1) / 2, heading, length, self.thickness))
        return found


class _BoxEntry(_Strict):
    x: _Number
    y: _Number
    length: _Size
    width: _Size
    heading: _Number = 0.0


class _CircleEntry(_Strict):
    x: _Number
    y: _Number
    radius: _Size


class _MapFile(_Strict):
    name: str
    bounds: _BoundsEntry
    wall: list[_WallEntry] = []
    box: list[_BoxEntry] = []
    circle: list[_CircleEntry] = []


def map_names() -> list[str]:
    """The maps that come with VRG."""
    folder = resources.files("vrg.hal.sim.maps")
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_map(name_or_path: str | Path) -> Map:
    """A map that comes with VRG, by name, or one of the user's, by the path of its .toml file.

    Raises:
        ConfigError: there is none of that name, it cannot be read, or its fields are wrong; all of them at once.
    """
    wanted = str(name_or_path)
    if wanted in map_names():
        return _parse(resources.files("vrg.hal.sim.maps").joinpath(f"{wanted}.toml").read_text("utf-8"), wanted)
    if not wanted.endswith(".toml"):
        close = difflib.get_close_matches(wanted, map_names(), n=1)
        guess = f", did you mean {close[0]!r}?" if close else ""
        raise ConfigError(
            [f"map: expected one of {', '.join(map_names())} or a path ending in .toml, got {wanted!r}{guess}"]
        )
    try:
        text = Path(wanted).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError([f"map: cannot read {wanted}: {error}"]) from None
    return _parse(text, wanted)


def _parse(text: str, file: str) -> Map:
    try:
        entry = _MapFile.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ConfigError([f"{file}: expected TOML: {error}"]) from None
    except ValidationError as error:
        raise ConfigError(
            [
                f"{file}: {'.'.join(str(part) for part in e['loc'])}: {e['msg']}, got {e['input']!r}"
                for e in error.errors()
            ]
        ) from None
    boxes = [box for wall in entry.wall for box in wall.boxes()]
    boxes += [Box(b.x, b.y, math.radians(b.heading), b.length, b.width) for b in entry.box]
    return Map(
        name=entry.name,
        bounds=Bounds(**entry.bounds.model_dump()),
        boxes=tuple(boxes),
        circles=tuple(Circle(c.x, c.y, c.radius) for c in entry.circle),
    )
