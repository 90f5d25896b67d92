"""The viewpoints, and the pursuit of a robot."""

import enum
import math
from dataclasses import dataclass
from typing import Final

from vrg.types import Pose, Vector
from vrg_views.three.ground import Extent

Point = tuple[float, float, float]
"""x, y and z in the map's frame, m."""
FIELD_OF_VIEW: Final = math.radians(42)
"""From the lower to the upper edge of the picture, rad."""
_SLOPE: Final = math.radians(38)
"""The angle at which the stand looks down, rad."""
SMOOTH: Final = 0.35
"""s in which most of the way to a new place is made."""


class CameraMode(enum.Enum):
    """The ways to look."""

    ORBIT = "Around"
    FOLLOW = "Follow"
    EYES = "Inside"
    TOP = "Above"


@dataclass(frozen=True)
class Shot:
    """A place to look from and a point to look at, m."""

    eye: Point
    target: Point


def overview(place: Extent, shape: float = 16 / 9) -> Shot:
    """The field as from a stand, so that its longer side lies along that of the picture.

    Args:
        shape: the width of the picture as a part of its height.
    """
    across, deep, turned = _laid(place, shape)
    tall = math.tan(FIELD_OF_VIEW / 2)
    distance = max(0.62 * across / (tall * shape), 0.48 * deep / tall) + 0.22 * deep
    back, up, ahead = distance * math.cos(_SLOPE), distance * math.sin(_SLOPE), 0.06 * deep
    if turned:
        return Shot((place.x + back, place.y, up), (place.x + ahead, place.y, 0.0))
    return Shot((place.x, place.y - back, up), (place.x, place.y - ahead, 0.0))


def above(place: Extent, shape: float = 16 / 9) -> Shot:
    """The field from straight above, a little low in the picture; see `overview`."""
    across, deep, turned = _laid(place, shape)
    tall = math.tan(FIELD_OF_VIEW / 2)
    height = max(0.55 * across / (tall * shape), 0.65 * deep / tall)
    # A camera that looks exactly along its own up direction would not know where up is.
    aside, tilt = 0.04 * deep, 0.001 * height
    if turned:
        return Shot((place.x - aside + tilt, place.y, height), (place.x - aside, place.y, 0.0))
    return Shot((place.x, place.y + aside - tilt, height), (place.x, place.y + aside, 0.0))


def _laid(place: Extent, shape: float) -> tuple[float, float, bool]:
    """The width and the depth of the field in the picture, m, and whether one looks along x, from the east."""
    turned = (place.width > place.length) == (shape >= 1.0)
    return (place.width, place.length, True) if turned else (place.length, place.width, False)


def behind(pose: Pose, size: float) -> Shot:
    """Over the shoulder of a robot whose body is `size` m long."""
    c, s, back = math.cos(pose.theta), math.sin(pose.theta), 1.9 + 2.6 * size
    return Shot((pose.x - back * c, pose.y - back * s, 0.9 + 1.5 * size), (pose.x + 0.9 * c, pose.y + 0.9 * s, 0.15))


def inside(pose: Pose, eye: Vector) -> Shot:
    """The view from a robot; `eye` is how far ahead of its middle and how high it looks from, m."""
    c, s, (ahead, height) = math.cos(pose.theta), math.sin(pose.theta), eye
    far = ahead + 6.0
    return Shot((pose.x + ahead * c, pose.y + ahead * s, height), (pose.x + far * c, pose.y + far * s, height - 0.9))


def eased(before: Shot, wanted: Shot, seconds: float) -> Shot:
    """The shot on its way from one to another after so much real time, s. A far way is made at once."""
    if math.dist(before.eye, wanted.eye) > 15.0:
        return wanted
    share = 1.0 - math.exp(-3.0 * seconds / SMOOTH)

    def between(a: Point, b: Point) -> Point:
        x, y, z = (p + share * (q - p) for p, q in zip(a, b, strict=True))
        return x, y, z

    return Shot(between(before.eye, wanted.eye), between(before.target, wanted.target))
