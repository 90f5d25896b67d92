"""Converts metres on the field to pixels in the window."""

import math
from dataclasses import dataclass
from typing import Final

from vrg.regions import Bounds, surrounding
from vrg.types import Vector
from vrg.ui.scene import Scene

Area = tuple[int, int, int, int]
"""left, top, width, height in pixels."""
Pixel = tuple[float, float]

MARGIN: Final = 0.5
"""m shown around the field, so that a player out of bounds is seen."""
BODY: Final = 0.4
"""m about the place where a body began that are shown too."""


@dataclass(frozen=True)
class Projection:
    """Maps the field into an area of the window and keeps its proportions.

    Args:
        x, y: the point of the field, m, that is shown at pixel `left`, `top`.
        scale: pixels per m.
        turned: shown a quarter turn clockwise: +y points right and +x down; else +x points right and +y up.
    """

    x: float
    y: float
    left: float
    top: float
    scale: float
    turned: bool

    def point(self, x: float, y: float) -> Pixel:
        """Return the pixel of a point of the field, m."""
        dx, dy = (x - self.x) * self.scale, (y - self.y) * self.scale
        return (self.left + dy, self.top + dx) if self.turned else (self.left + dx, self.top - dy)

    def place(self, px: float, py: float) -> Vector:
        """Return the point of the field, m, at a pixel: the inverse of `point`."""
        right, down = (px - self.left) / self.scale, (py - self.top) / self.scale
        return (self.x + down, self.y + right) if self.turned else (self.x + right, self.y - down)

    def angle(self, theta: float) -> float:
        """A heading on the field as an angle in the window: rad, 0 is right, pi/2 is up."""
        return theta - math.pi / 2 if self.turned else theta


def fit(box: Bounds, area: Area, turned: bool | None = None) -> Projection:
    """Show `box` as large as `area` allows.

    Args:
        turned: by 90 degrees or not; None turns it where that shows it larger.
    """
    wide, tall = max(box[2] - box[0], 0.1), max(box[3] - box[1], 0.1)
    left, top, width, height = area
    # The small factor keeps a nearly square field as its map shows it.
    if turned is None:
        turned = min(width / tall, height / wide) > min(width / wide, height / tall) * 1.02
    scale = min(width / tall, height / wide) if turned else min(width / wide, height / tall)
    return Projection(
        x=(box[0] + box[2]) / 2,
        y=(box[1] + box[3]) / 2,
        left=left + width / 2,
        top=top + height / 2,
        scale=max(scale, 0.01),
        turned=turned,
    )


def extent(scene: Scene) -> Bounds:
    """The part of the world to show: the zones, without them the walls, and without those the bodies.

    Where there are zones, the places where bodies began are shown too.
    """
    boxes = [region.bounds for region in [zone.region for zone in scene.zones] or scene.obstacles]
    if scene.zones:
        boxes += [(x - BODY, y - BODY, x + BODY, y + BODY) for x, y in scene.starts]
    if not boxes:
        points = [(b.pose.x, b.pose.y) for b in scene.bodies] or [(0.0, 0.0)]
        boxes = [(x - 3.0, y - 3.0, x + 3.0, y + 3.0) for x, y in points]
    x_min, y_min, x_max, y_max = surrounding(boxes)
    return x_min - MARGIN, y_min - MARGIN, x_max + MARGIN, y_max + MARGIN
