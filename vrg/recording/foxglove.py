"""Foxglove's well-known message types, as far as a recording uses them.

They are described at docs.foxglove.dev, "Schemas". Fields that a recording leaves empty are missing here. Lengths are
metres, angles radians, and every pose is in the map's frame.
"""

from typing import Final

from msgspec import Struct

from vrg.portable.scalars import cos, sin

FRAME_ID: Final = "map"
"""The name of the one frame of reference."""


class Time(Struct, frozen=True, gc=False):
    """An instant of match time, or a duration."""

    sec: int
    nsec: int


class Vector3(Struct, frozen=True, gc=False):
    """A point or a size, m."""

    x: float
    y: float
    z: float


class Quaternion(Struct, frozen=True, gc=False):
    """A rotation, as a unit quaternion."""

    x: float
    y: float
    z: float
    w: float


class Pose(Struct, frozen=True, gc=False):
    """A position and a rotation."""

    position: Vector3
    orientation: Quaternion


class Color(Struct, frozen=True, gc=False):
    """Red, green, blue and opacity, each 0 to 1."""

    r: float
    g: float
    b: float
    a: float


class PoseInFrame(Struct, frozen=True, gc=False):
    """foxglove.PoseInFrame: where something was at an instant."""

    timestamp: Time
    frame_id: str
    pose: Pose


class LaserScan(Struct, frozen=True, gc=False):
    """foxglove.LaserScan: ranges in m at equal steps from start_angle to end_angle, rad from the pose's heading."""

    timestamp: Time
    frame_id: str
    pose: Pose
    start_angle: float
    end_angle: float
    ranges: list[float]
    intensities: list[float]


class CompressedImage(Struct, frozen=True, gc=False):
    """foxglove.CompressedImage: a picture, as the bytes of a file of this format."""

    timestamp: Time
    frame_id: str
    data: bytes
    format: str


class LocationFix(Struct, frozen=True, gc=False):
    """foxglove.LocationFix: a place on the earth, WGS 84, degrees; north and east are positive."""

    timestamp: Time
    frame_id: str
    latitude: float
    longitude: float


class Log(Struct, frozen=True, gc=False):
    """foxglove.Log: a line of the viewer's log panel. Level 2 is information."""

    timestamp: Time
    level: int
    message: str
    name: str
    file: str
    line: int


class ArrowPrimitive(Struct, frozen=True, gc=False):
    """An arrow along the pose's x axis, lengths in m."""

    pose: Pose
    shaft_length: float
    shaft_diameter: float
    head_length: float
    head_diameter: float
    color: Color


class CubePrimitive(Struct, frozen=True, gc=False):
    """A box about its pose, size in m."""

    pose: Pose
    size: Vector3
    color: Color


class SpherePrimitive(Struct, frozen=True, gc=False):
    """An ellipsoid about its pose, size in m."""

    pose: Pose
    size: Vector3
    color: Color


class LinePrimitive(Struct, frozen=True, gc=False):
    """A line through points that are relative to its pose, thickness in m. Type 0 is open, type 1 a closed loop."""

    type: int
    pose: Pose
    thickness: float
    scale_invariant: bool
    points: list[Vector3]
    color: Color


class TriangleListPrimitive(Struct, frozen=True, gc=False):
    """Triangles between points that are relative to its pose; each three indices are one triangle."""

    pose: Pose
    points: list[Vector3]
    color: Color
    indices: list[int]


class TextPrimitive(Struct, frozen=True, gc=False):
    """Words in the scene, font size in m. A billboard turns towards the viewer."""

    pose: Pose
    billboard: bool
    font_size: float
    scale_invariant: bool
    color: Color
    text: str


class SceneEntity(Struct, frozen=True, gc=False):
    """A thing in the scene. It replaces an earlier one of the same id; a lifetime of 0 has no end."""

    timestamp: Time
    frame_id: str
    id: str
    lifetime: Time
    frame_locked: bool
    arrows: list[ArrowPrimitive]
    cubes: list[CubePrimitive]
    lines: list[LinePrimitive]
    texts: list[TextPrimitive]
    triangles: list[TriangleListPrimitive] = []
    spheres: list[SpherePrimitive] = []


class SceneEntityDeletion(Struct, frozen=True, gc=False):
    """An entity that disappears. Type 1 deletes every entity of the topic."""

    timestamp: Time
    type: int
    id: str


class SceneUpdate(Struct, frozen=True, gc=False):
    """foxglove.SceneUpdate: what changes in the scene."""

    deletions: list[SceneEntityDeletion]
    entities: list[SceneEntity]


def everything(at: Time) -> SceneEntityDeletion:
    """The deletion of all that a topic has shown."""
    return SceneEntityDeletion(at, 1, "")


def time_of(stamp: float) -> Time:
    """A match time in s as whole seconds and nanoseconds."""
    seconds, rest = divmod(round(stamp * 1e9), 1_000_000_000)
    return Time(seconds, rest)


def pose_of(x: float, y: float, theta: float, z: float = 0.0) -> Pose:
    """A planar pose in m and rad, `z` m above ground."""
    half = theta / 2
    return Pose(Vector3(x, y, z), Quaternion(0.0, 0.0, sin(half), cos(half)))
