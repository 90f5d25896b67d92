"""What a recording is made of: the message types that Foxglove knows, and our own, with their JSON schemas.

The types named `foxglove.*` are Foxglove's well-known schemas (docs.foxglove.dev, "Schemas"), without the fields
that we leave empty. The others are ours, named `vrg.*`. Optional fields are empty strings here and never null:
the viewer's schema reader has no union types.
"""

import math
from typing import Any, Final

import msgspec
from msgspec import Struct

from vrg.bus import messages as m

FRAME: Final = "map"
"""The one frame of reference: the map's."""


class Time(Struct, frozen=True, gc=False):
    """Match time."""

    sec: int
    nsec: int


class Vector3(Struct, frozen=True, gc=False):
    """m."""

    x: float
    y: float
    z: float


class Quaternion(Struct, frozen=True, gc=False):
    """A rotation."""

    x: float
    y: float
    z: float
    w: float


class Pose(Struct, frozen=True, gc=False):
    """Where something is and how it is turned."""

    position: Vector3
    orientation: Quaternion


class Color(Struct, frozen=True, gc=False):
    """Each 0 to 1."""

    r: float
    g: float
    b: float
    a: float


class PoseInFrame(Struct, frozen=True, gc=False):
    """foxglove.PoseInFrame."""

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


class Log(Struct, frozen=True, gc=False):
    """foxglove.Log; level 2 is information."""

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


class LinePrimitive(Struct, frozen=True, gc=False):
    """Line type 1 is a closed loop; thickness in m."""

    type: int
    pose: Pose
    thickness: float
    scale_invariant: bool
    points: list[Vector3]
    color: Color


class TextPrimitive(Struct, frozen=True, gc=False):
    """A billboard, font size in m."""

    pose: Pose
    billboard: bool
    font_size: float
    scale_invariant: bool
    color: Color
    text: str


class SceneEntity(Struct, frozen=True, gc=False):
    """A thing in the scene; it replaces the one of the same id."""

    timestamp: Time
    frame_id: str
    id: str
    lifetime: Time
    frame_locked: bool
    arrows: list[ArrowPrimitive]
    cubes: list[CubePrimitive]
    lines: list[LinePrimitive]
    texts: list[TextPrimitive]


class SceneEntityDeletion(Struct, frozen=True, gc=False):
    """Type 1 deletes every entity of the topic."""

    timestamp: Time
    type: int
    id: str


class SceneUpdate(Struct, frozen=True, gc=False):
    """foxglove.SceneUpdate."""

    deletions: list[SceneEntityDeletion]
    entities: list[SceneEntity]


class PlayerRecord(Struct, frozen=True, gc=False):
    """A player as the referee saw it."""

    name: str
    team: str
    role: str
    state: str
    may_move: bool


class StateRecord(Struct, frozen=True, gc=False):
    """vrg.RefereeState: `messages.RefereeState` without nulls."""

    timestamp: Time
    game: str
    stage: str
    halted: str
    waiting: list[str]
    clock: float
    total: float
    round: int
    rounds: int
    score: dict[str, int]
    winner: str
    estop: bool
    players: list[PlayerRecord]
    zones: list[m.Zone]


class ReportRecord(Struct, frozen=True, gc=False):
    """vrg.Report: what a player said of itself."""

    timestamp: Time
    mode: str
    armed: bool
    manual: bool
    fault: str
    latched: bool


class CallRecord(Struct, frozen=True, gc=False):
    """vrg.Call: a referee's call with whom and where; `round` is the one being played."""

    timestamp: Time
    number: int
    rule: str
    text: str
    players: list[str]
    poses: list[m.Pose]
    clock: float
    round: int


SCHEMA_NAMES: Final[dict[type[Struct], str]] = {
    SceneUpdate: "foxglove.SceneUpdate",
    PoseInFrame: "foxglove.PoseInFrame",
    LaserScan: "foxglove.LaserScan",
    Log: "foxglove.Log",
    StateRecord: "vrg.RefereeState",
    ReportRecord: "vrg.Report",
    CallRecord: "vrg.Call",
}


def json_schema(record: type[Struct]) -> bytes:
    """The type's JSON schema, `"type": "object"` at its top and without references, which viewers do not follow."""
    schema = msgspec.json.schema(record)
    definitions: dict[str, Any] = schema.pop("$defs")

    def inline(node: Any) -> Any:
        if isinstance(node, dict):
            reference = node.get("$ref")
            if reference is not None:
                return inline(definitions[reference.rsplit("/", 1)[1]])
            return {key: inline(value) for key, value in node.items()}
        return [inline(item) for item in node] if isinstance(node, list) else node

    return msgspec.json.encode(inline(schema))


def pose_of(x: float, y: float, theta: float, z: float = 0.0) -> Pose:
    """A planar pose in m and rad, `z` m above ground."""
    half = theta / 2
    return Pose(Vector3(x, y, z), Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))


def heading_of(orientation: Quaternion) -> float:
    """The heading in rad, -pi to pi, of a rotation about the vertical axis."""
    return math.remainder(2 * math.atan2(orientation.z, orientation.w), 2 * math.pi)
