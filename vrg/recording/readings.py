"""What is recorded of readings: a type that viewers draw, where there is one, otherwise the message as it is."""

import math
from typing import Any, Final

from msgspec import Struct, structs

from vrg.bus.messages import SensorMessage
from vrg.geometry import compose
from vrg.hal.sensors.depiction import Cones, Image, Place, Rays
from vrg.hal.sensors.spec import SensorSpec
from vrg.recording import foxglove as fg
from vrg.recording.scene import cones_entity
from vrg.types import Pose

_DIGITS: Final = 6
"""The decimals of ranges in m. All digits of a float would be half of a recording."""


def records_of(
    reading: SensorMessage, spec: SensorSpec | None, at: fg.Time, name: str, where: Pose | None
) -> list[Struct]:
    """What is recorded of one reading: types of `vrg.recording.foxglove`, or the message.

    Args:
        spec: of the sensor; None if it is not known. Then the message is recorded as it is.
        name: of the sensor, with that of its robot.
        where: the robot's body when it was measured; None if that is not known. Then nothing is drawn.
    """
    match None if spec is None else spec.depict(reading):
        case Rays() as rays:
            return [] if where is None else [_scan(rays, at, where)]
        case Cones() as cones:
            drawn = [] if where is None else [fg.SceneUpdate([], [cones_entity(name, cones, where, at)])]
            fields = {name: _rounded(getattr(reading, name)) for name in reading.__struct_fields__}
            return [structs.replace(reading, **fields), *drawn]
        case Image() as picture:
            return [fg.CompressedImage(at, name, picture.png, "png")]
        case Place() as place:
            return _place(place, at)
        case _:
            return [reading]


def _scan(rays: Rays, at: fg.Time, where: Pose) -> fg.LaserScan:
    # In mm: the digits that float32 adds to a range in m would be half of the recording.
    ranges = [round(r, 3) for r in rays.ranges]
    end = rays.first + rays.step * max(0, len(ranges) - 1)
    pose = compose(where, rays.mount)
    return fg.LaserScan(at, fg.FRAME_ID, fg.pose_of(pose.x, pose.y, pose.theta), rays.first, end, ranges, [])


def _place(place: Place, at: fg.Time) -> list[Struct]:
    """The place on the earth in degrees. Without a place there is no record: a viewer would show the place (0, 0)."""
    if place.latitude is None or place.longitude is None:
        return []
    # The ninth decimal of a degree is a tenth of a millimetre.
    latitude, longitude = round(math.degrees(place.latitude), 9), round(math.degrees(place.longitude), 9)
    return [fg.LocationFix(at, fg.FRAME_ID, latitude, longitude)]


def _rounded(value: Any) -> Any:
    """A number or a tuple of numbers with _DIGITS decimals."""
    if isinstance(value, tuple):
        return tuple(map(_rounded, value))
    return round(value, _DIGITS) if isinstance(value, float) else value
