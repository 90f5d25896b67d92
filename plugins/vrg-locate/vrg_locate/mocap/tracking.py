"""From rigid bodies to the poses of robots: frames, and what is no measurement. This module is pure."""

import math
from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Final, Literal

from msgspec import Struct

from vrg.geometry import compose, inverse
from vrg.portable.scalars import atan2
from vrg.types import Pose
from vrg_locate.mocap.frames import MeasuredBody, MocapFrame

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

TIPPED: Final = math.radians(30.0)
"""The tilt from which on a robot has tipped over, or the axes of its body are not what they are taken for."""
FROZEN: Final = 0.5
"""The time in s for which a rigid body may be the same, bit for bit, before it is worth a word."""
_FAR: Final = 1e4
"""The distance in m from the system's origin which nothing that is captured has."""
_UNIT: Final = 0.1
"""By how much the length of a quaternion may differ from 1: systems fill what they have not measured with zeros."""


class Fault(StrEnum):
    """The reasons for which a rigid body gives no fix."""

    UNKNOWN = "unknown"
    """It is of no robot."""
    UNTRACKED = "untracked"
    """The system has not measured it in this frame."""
    REPEATED = "repeated"
    """It is the same as in the frame before: real measurements have noise."""
    FROZEN = "frozen"
    """It has been the same for a while."""
    TIPPED = "tipped"
    """It does not stand upright."""


class Outcome(Struct, frozen=True):
    """The reading of a rigid body in a frame.

    Args:
        body: its name. robot: whose it is; None if nobody's.
        found: the pose of the robot on the map, or why there is none.
    """

    body: str
    robot: str | None
    found: Pose | Fault


class Tracking:
    """Takes in frames, and says where they show robots.

    Args:
        robots: the robot of each rigid body, by the body's name. offsets: the poses of the bodies in the frames of
            their robots, by the robot's name; a robot that is not named has its body at its centre, and straight ahead.
        up: the axis of the system that points up. origin: the pose of its frame on the map.
    """

    def __init__(
        self, robots: Mapping[str, str], offsets: Mapping[str, Pose], up: Literal["y", "z"], origin: Pose
    ) -> None:
        self._robots, self._up, self._origin = robots, up, origin
        self._back = {robot: inverse(offset) for robot, offset in offsets.items()}
        self._before: dict[str, tuple[MeasuredBody, float]] = {}
        """The newest measurement of each robot's body, and when it was new, monotonic, s."""

    def take(self, frame: MocapFrame) -> list[Outcome]:
        """The outcome of each rigid body in a frame."""
        return [Outcome(body.name, robot, found) for body, robot, found in self._sorted(frame)]

    def _sorted(self, frame: MocapFrame) -> Iterable[tuple[MeasuredBody, str | None, Pose | Fault]]:
        for body in frame.bodies:
            robot = self._robots.get(body.name)
            yield body, robot, Fault.UNKNOWN if robot is None else self._found(robot, body, frame.time)

    def _found(self, robot: str, body: MeasuredBody, time: float) -> Pose | Fault:
        if not is_measured(body):
            return Fault.UNTRACKED
        before = self._before.get(robot)
        if before is not None and before[0] == body:
            return Fault.FROZEN if time - before[1] >= FROZEN else Fault.REPEATED
        self._before[robot] = body, time
        position, rotation = with_z_up(body.position, body.rotation, self._up)
        if tilt(rotation) > TIPPED:
            return Fault.TIPPED
        seen = compose(self._origin, Pose(position[0], position[1], heading(rotation)))
        return compose(seen, self._back[robot]) if robot in self._back else seen


def is_measured(body: MeasuredBody) -> bool:
    """True if the numbers of a rigid body can be those of something that a system has seen."""
    length = math.hypot(*body.rotation)
    near = all(abs(value) <= _FAR for value in body.position)
    return near and abs(length - 1.0) <= _UNIT


def with_z_up(position: Vector3, rotation: Quaternion, up: Literal["y", "z"]) -> tuple[Vector3, Quaternion]:
    """The position and the rotation in a frame with z up.

    With y up, both the system and the axes of its bodies are turned by 90 degrees about x: (x, y, z) becomes
    (x, -z, y), and so does the vector of a quaternion, as conjugation turns nothing but its axis.
    """
    if up == "z":
        return position, rotation
    (x, y, z), (w, i, j, k) = position, rotation
    return (x, -z, y), (w, i, -k, j)


def heading(rotation: Quaternion) -> float:
    """The direction of a body's x axis on the floor, rad, counter-clockwise seen from above, where z is up.

    A quaternion (w, x, y, z) turns (1, 0, 0) to (w^2 + x^2 - y^2 - z^2, 2 (x y + w z), ...), whose direction is
    atan2(2 (w z + x y), w^2 + x^2 - y^2 - z^2).
    """
    w, x, y, z = rotation
    return atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def tilt(rotation: Quaternion) -> float:
    """The angle between a body's z axis and straight up, rad, 0 to pi.

    A quaternion turns (0, 0, 1) to a vector of height w^2 - x^2 - y^2 + z^2 and of width
    2 hypot(w y + x z, y z - w x).
    """
    w, x, y, z = rotation
    return atan2(2.0 * math.hypot(w * y + x * z, y * z - w * x), w * w - x * x - y * y + z * z)
