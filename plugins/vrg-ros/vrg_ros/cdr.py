"""The types of ROS 2 that VRG speaks, and their messages as bytes (Common Data Representation), both by rosbags.

The definitions are those of Jazzy, which newer distributions keep. A message is a mapping from the names of its fields
to their values; fields that are left out are 0, empty, or made of such.
"""

import struct
from collections.abc import Mapping
from functools import cache
from typing import Any, Final

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from vrg.errors import MessageError

Message = Mapping[str, Any]

STORE: Final = get_typestore(Stores.ROS2_JAZZY)
_HEADER: Final = b"\x00\x01\x00\x00"


def _whole(kind: str) -> str:
    """The name of a type such as `nav_msgs/Odometry` as rosbags has it."""
    return kind.replace("/", "/msg/", 1)


HASHES: Final = {
    kind: STORE.hash_rihs01(_whole(kind))
    for kind in (
        "geometry_msgs/PoseStamped", "geometry_msgs/Twist", "geometry_msgs/TwistStamped", "nav_msgs/OccupancyGrid",
        "nav_msgs/Odometry", "rosgraph_msgs/Clock", "sensor_msgs/BatteryState", "sensor_msgs/LaserScan",
        "sensor_msgs/NavSatFix", "sensor_msgs/Range", "std_msgs/String", "tf2_msgs/TFMessage",
        "visualization_msgs/MarkerArray",
    )
}  # fmt: skip
"""The hash (REP 2016) of each type that travels as a message; it begins with RIHS_PREFIX."""
RIHS_PREFIX: Final = "RIHS01_"


def encode(kind: str, message: Message) -> bytes:
    """The bytes of a message of a type such as `nav_msgs/Odometry`.

    Raises:
        ValueError: a field is unknown, or its value is not of its type.
    """
    try:
        made = _made(Nodetype.NAME, _whole(kind), message)
        return bytes(STORE.serialize_cdr(made, _whole(kind), little_endian=True))
    except (struct.error, TypeError, AttributeError, ValueError, OverflowError) as error:
        raise ValueError(f"{kind}: a value is not of its type: {error}") from None


def decode(kind: str, data: bytes) -> dict[str, Any]:
    """The message of a type that stands in bytes.

    Raises:
        MessageError: they are none of that type.
    """
    if data[: len(_HEADER)] != _HEADER:
        raise MessageError(f"{kind}: expected little-endian CDR, got bytes that begin with {data[:4].hex() or 'none'}")
    try:
        read = STORE.deserialize_cdr(data, _whole(kind))
    except SerdeError as error:
        raise MessageError(f"{kind}: the bytes end too early, or are of another type: {error}") from None
    message: dict[str, Any] = _plain(Nodetype.NAME, _whole(kind), read)
    return message


@cache
def _fields(kind: str) -> Mapping[str, tuple[Nodetype, Any]]:
    """The form of each field of a type, and what it is of, as rosbags has them."""
    return dict(STORE.fielddefs[kind][1])


def _made(form: Nodetype, what: Any, value: Any) -> Any:
    """A value of a form as rosbags wants it; None where it is left out."""
    if value is None:
        return _left_out(form, what)
    if form is Nodetype.NAME:
        fields = _fields(what)
        if not value.keys() <= fields.keys():
            raise ValueError(f"{what} has no field {', '.join(sorted(value.keys() - fields.keys()))}")
        return STORE.types[what](**{name: _made(of, by, value.get(name)) for name, (of, by) in fields.items()})
    if form is Nodetype.BASE:
        return value
    (of, by), count = what
    if form is Nodetype.ARRAY and len(value) != count:
        raise ValueError(f"expected {count} values, got {len(value)}")
    return np.array(value, dtype=by[0]) if of is Nodetype.BASE else [_made(of, by, each) for each in value]


@cache
def _left_out(form: Nodetype, what: Any) -> Any:
    """The value of a field that is left out. Nobody changes it, so that it serves for all."""
    if form is Nodetype.NAME:
        return _made(form, what, {})
    if form is Nodetype.BASE:
        return "" if what[0] == "string" else 0
    return _made(form, what, [0] * what[1] if form is Nodetype.ARRAY else [])


def _plain(form: Nodetype, what: Any, value: Any) -> Any:
    """A value of a form, as rosbags has it, without its classes."""
    if form is Nodetype.NAME:
        return {name: _plain(of, by, getattr(value, name)) for name, (of, by) in _fields(what).items()}
    if form is Nodetype.BASE:
        return value
    return value.tolist() if isinstance(value, np.ndarray) else [_plain(what[0][0], what[0][1], each) for each in value]
