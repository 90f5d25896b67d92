"""The records of sensors' readings: types that viewers draw, where there is one, otherwise the message as it is."""

import math
import struct
from typing import Any, Final

from msgspec import Struct, structs

from vrg.bus.messages import SensorMessage
from vrg.hal.models.description import RobotModel
from vrg.hal.sensors.camera import Camera
from vrg.hal.sensors.gps import Gps
from vrg.hal.sensors.ins import Ins
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.hal.sensors.sonar import Sonar
from vrg.recording import foxglove as fg
from vrg.recording.scene import laser_pose, sonar_entity
from vrg.types import Pose

_DIGITS: Final = 6
"""The decimals of numbers in m, rad, m/s and rad/s. All digits of a float would be half of a recording."""


def records_of(
    reading: SensorMessage, at: fg.Time, robot: str, sensor: str, where: Pose | None, model: RobotModel | None
) -> list[tuple[str, Struct]]:
    """The records of one reading, each with what its topic ends in after the topic of the sensor.

    Args:
        robot, sensor: the names of the robot and of the sensor on it.
        where: the robot's body when it was measured; None if that is not known. Then nothing is drawn.
        model: the description of the robot; None if it is not known.
    """
    if isinstance(reading, Laser):
        return [] if where is None else [("", _scan(reading, at, laser_pose(where, model, sensor)))]
    if isinstance(reading, Sonar):
        cones = None if where is None else sonar_entity(robot, sensor, reading, where, model, at)
        drawn: list[tuple[str, Struct]] = [] if cones is None else [("/cones", fg.SceneUpdate([], [cones]))]
        return [("", _rounded(reading)), *drawn]
    if isinstance(reading, Gps):
        return _fix(reading, at)
    if isinstance(reading, Camera):
        return [("", fg.CompressedImage(at, f"{robot}/{sensor}", reading.data, "png"))]
    if isinstance(reading, Ins):
        pose = _rounded(reading.pose)
        return [("", fg.PoseInFrame(at, fg.FRAME, _rounded(fg.pose_of(pose.x, pose.y, pose.theta))))]
    return [("", _rounded(reading) if isinstance(reading, Odometry) else reading)]


def _scan(scan: Laser, at: fg.Time, pose: fg.Pose) -> fg.LaserScan:
    # In mm: the digits that float32 adds to a range in m would be half of the recording.
    ranges = [round(r, 3) for r in struct.unpack(f"<{len(scan.data) // 4}f", scan.data)]
    end = scan.angle_min + scan.angle_step * max(0, len(ranges) - 1)
    return fg.LaserScan(at, fg.FRAME, pose, scan.angle_min, end, ranges, [])


def _fix(gps: Gps, at: fg.Time) -> list[tuple[str, Struct]]:
    """The place on the earth in degrees. Without a fix there is no record: a viewer would show the place (0, 0)."""
    if gps.latitude is None or gps.longitude is None:
        return []
    # The ninth decimal of a degree is a tenth of a millimetre.
    latitude, longitude = round(math.degrees(gps.latitude), 9), round(math.degrees(gps.longitude), 9)
    return [("", fg.LocationFix(at, fg.FRAME, latitude, longitude))]


def _rounded(value: Any) -> Any:
    """The same with its floats rounded to _DIGITS decimals."""
    match value:
        case float():
            return round(value, _DIGITS)
        case tuple():
            return tuple(map(_rounded, value))
        case Struct():
            fields = {name: _rounded(getattr(value, name)) for name in value.__struct_fields__}
            return structs.replace(value, **fields)
        case _:
            return value
