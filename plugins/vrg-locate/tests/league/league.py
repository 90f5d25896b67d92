"""Packets as the vision and the trackers of the league send them."""

import struct
from collections.abc import Mapping
from typing import Any

from vrg_locate.ssl.packets import TRACKER, WRAPPER, Seen
from vrg_locate.ssl.wire import Field, Kind, Layout


def encode(values: Mapping[str, Any], layout: Layout) -> bytes:
    """The bytes of a message; fields that are missing, or None, are left out."""
    parts = []
    for number, field in layout.items():
        if (value := values.get(field.name)) is not None:
            parts += [_encoded(number, field, one) for one in (value if field.many else (value,))]
    return b"".join(parts)


def _encoded(number: int, field: Field, value: Any) -> bytes:
    if not isinstance(field.kind, Kind):
        data = encode(value, field.kind)
        return _varint(number << 3 | 2) + _varint(len(data)) + data
    head = _varint(number << 3 | field.kind.value)
    return head + (
        _varint(value) if field.kind is Kind.UINT else struct.pack("<d" if field.kind is Kind.DOUBLE else "<f", value)
    )


def _varint(value: int) -> bytes:
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    return bytes(found)


def vision_packet(seen: Seen) -> bytes:
    """A packet of vision."""
    robots: dict[str, list[dict[str, Any]]] = {"robots_yellow": [], "robots_blue": []}
    for robot in seen.robots:
        robots[f"robots_{robot.colour}"].append(
            {"confidence": robot.confidence, "robot_id": robot.number, "x": 1000.0 * robot.x, "y": 1000.0 * robot.y,
             "orientation": robot.heading}
        )  # fmt: skip
    balls = [{"confidence": ball.confidence, "x": 1000.0 * ball.x, "y": 1000.0 * ball.y} for ball in seen.balls]
    detection = {"t_capture": seen.captured, "t_sent": seen.sent, "camera_id": seen.camera, "balls": balls, **robots}
    return encode({"detection": detection}, WRAPPER)


def tracker_packet(seen: Seen) -> bytes:
    """A packet of a tracker."""
    robots = [
        {
            "robot_id": {"id": robot.number, "team": 1 if robot.colour == "yellow" else 2},
            "pos": {"x": robot.x, "y": robot.y},
            "orientation": robot.heading,
            "visibility": robot.confidence,
        }
        for robot in seen.robots
    ]
    balls = [{"pos": {"x": ball.x, "y": ball.y}, "visibility": ball.confidence} for ball in seen.balls]
    return encode({"tracked_frame": {"timestamp": seen.captured, "balls": balls, "robots": robots}}, TRACKER)
