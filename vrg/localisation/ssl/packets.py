"""The content of the packets of the Small Size League, in SI units, and the packets that tell of a match.

The frame is that of the league's field: its origin is in the middle, x along its length. Numbers that cannot be raise
errors.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from vrg.errors import MessageError
from vrg.localisation.ssl.layouts import REFEREE, TRACKER, WRAPPER
from vrg.localisation.ssl.wire import decode, encode
from vrg.types import Twist

Colour = Literal["yellow", "blue"]
COLOURS: Final[tuple[Colour, Colour]] = ("yellow", "blue")
_TEAMS: Final[Mapping[int, Colour]] = {1: "yellow", 2: "blue"}
_FAR: Final = 1e3
"""The coordinate in m beyond which no field reaches."""


@dataclass(frozen=True)
class SeenRobot:
    """A robot in a packet.

    Args:
        colour, number: which one it is. x, y: m. heading: rad; None if it was not seen.
        confidence: how sure the sender is of it, 0 to 1. twist: its velocity in its own frame, where that is known.
    """

    colour: Colour
    number: int
    x: float
    y: float
    heading: float | None
    confidence: float = 1.0
    twist: Twist | None = None


@dataclass(frozen=True)
class Seen:
    """The robots that were seen at one instant.

    Args:
        captured, sent: when the picture was taken, and when the packet was sent, by the sender's clock, s.
        camera: the number of the camera; 0 for a tracker.
    """

    captured: float
    sent: float
    robots: Sequence[SeenRobot]
    camera: int = 0


def read_vision(data: bytes) -> Seen | None:
    """The robots in a packet of vision; None if it has the geometry of the field alone.

    Raises:
        MessageError: it is no such packet, or has numbers that cannot be.
    """
    frame = decode(data, WRAPPER).get("detection")
    if frame is None:
        return None
    robots = [
        SeenRobot(
            colour,
            _needed(one, "robot_id"),
            _number(one, "x", 1000.0 * _FAR) / 1000.0,
            _number(one, "y", 1000.0 * _FAR) / 1000.0,
            _angle(one),
            _share(one, "confidence"),
        )
        for colour in COLOURS
        for one in frame[f"robots_{colour}"]
        if "robot_id" in one  # a robot whose pattern was not recognised has none
    ]
    return Seen(_time(frame, "t_capture"), _time(frame, "t_sent"), robots, frame.get("camera_id", 0))


def read_tracker(data: bytes) -> Seen:
    """The robots in a packet of a tracker.

    Raises:
        MessageError: it is no such packet, or has numbers that cannot be.
    """
    frame = decode(data, TRACKER).get("tracked_frame")
    if frame is None:
        raise MessageError("expected the packet of a tracker, got one without its frame: is it one of vision?")
    robots = []
    for one in frame["robots"]:
        robot, at = one.get("robot_id", {}), one.get("pos", {})
        colour = _TEAMS.get(robot.get("team", 0))
        if colour is not None:
            x, y = _number(at, "x", _FAR), _number(at, "y", _FAR)
            robots.append(SeenRobot(colour, _needed(robot, "id"), x, y, _angle(one), _share(one, "visibility")))
    time = _time(frame, "timestamp")
    return Seen(time, time, robots)


def _needed(table: Mapping[str, Any], name: str) -> Any:
    if name not in table:
        raise MessageError(f"{name}: expected it, found none")
    return table[name]


def _number(table: Mapping[str, Any], name: str, most: float) -> float:
    value = float(_needed(table, name))
    if not abs(value) <= most:
        raise MessageError(f"{name}: expected a number of at most {most:g}, got {value}")
    return value


def _time(table: Mapping[str, Any], name: str) -> float:
    return _number(table, name, 1e11)


def _share(table: Mapping[str, Any], name: str) -> float:
    return min(1.0, max(0.0, _number(table, name, 1e6))) if name in table else 1.0


def _angle(table: Mapping[str, Any]) -> float | None:
    return _number(table, "orientation", 1e4) if "orientation" in table else None


def vision_packet(number: int, seen: Seen, size: tuple[float, float] | None = None) -> bytes:
    """A packet of vision.

    Args:
        number: counts the packets. size: the length and the width of the field, m; None leaves it out.
    """
    robots: dict[Colour, list[dict[str, Any]]] = {colour: [] for colour in COLOURS}
    for robot in seen.robots:
        x, y = 1000.0 * robot.x, 1000.0 * robot.y
        robots[robot.colour].append(
            {"confidence": robot.confidence, "robot_id": robot.number, "x": x, "y": y, "orientation": robot.heading,
             "pixel_x": 0.0, "pixel_y": 0.0}
        )  # fmt: skip
    detection = {
        "frame_number": number, "t_capture": seen.captured, "t_sent": seen.sent, "camera_id": seen.camera,
        "robots_yellow": robots["yellow"], "robots_blue": robots["blue"],
    }  # fmt: skip
    return encode({"detection": detection, "geometry": None if size is None else {"field": _field(*size)}}, WRAPPER)


def _field(length: float, width: float) -> dict[str, Any]:
    """The geometry of a field with an edge and a line across its middle; a game of VRG has no goals."""
    x, y = 500.0 * length, 500.0 * width
    lines = {
        "TopTouchLine": ((-x, y), (x, y)), "BottomTouchLine": ((-x, -y), (x, -y)),
        "LeftGoalLine": ((-x, -y), (-x, y)), "RightGoalLine": ((x, -y), (x, y)), "HalfwayLine": ((0.0, -y), (0.0, y)),
    }  # fmt: skip
    return {
        "field_length": round(2 * x), "field_width": round(2 * y), "goal_width": 0, "goal_depth": 0,
        "boundary_width": 300,
        "field_lines": [
            {"name": name, "p1": {"x": a[0], "y": a[1]}, "p2": {"x": b[0], "y": b[1]}, "thickness": 10.0}
            for name, (a, b) in lines.items()
        ],
    }  # fmt: skip


def tracker_packet(number: int, seen: Seen, uuid: str, name: str) -> bytes:
    """A packet of a tracker.

    Args:
        number: counts the packets. uuid, name: of the tracker.
    """
    robots = []
    for robot in seen.robots:
        heading, twist = robot.heading or 0.0, robot.twist
        cos, sin = math.cos(heading), math.sin(heading)
        robots.append(
            {
                "robot_id": {"id": robot.number, "team": 1 + COLOURS.index(robot.colour)},
                "pos": {"x": robot.x, "y": robot.y},
                "orientation": heading,
                "vel": None
                if twist is None
                else {"x": cos * twist.v - sin * twist.side, "y": sin * twist.v + cos * twist.side},
                "vel_angular": None if twist is None else twist.w,
                "visibility": robot.confidence,
            }
        )
    frame = {"frame_number": number, "timestamp": seen.captured, "robots": robots}
    return encode({"uuid": uuid, "source_name": name, "tracked_frame": frame}, TRACKER)


@dataclass(frozen=True)
class RefereeNews:
    """The state of a match in the league's words.

    Args:
        time: s since 1970. stage, command: the league's numbers; see `vrg.localisation.ssl.publisher`.
        counter: rises with each new command. since: when the command was given, s since 1970.
        left: the time that is left of the stage, s; None if it has no end.
        teams: the name, the score and the fouls of the yellow and of the blue team. words: for people.
    """

    time: float
    stage: int
    command: int
    counter: int
    since: float
    left: float | None
    teams: Sequence[tuple[str, int, int]]
    words: str = ""


def referee_packet(news: RefereeNews) -> bytes:
    """A packet of the game controller."""
    teams: Iterable[dict[str, Any]] = (
        {"name": name, "score": max(0, score), "red_cards": 0, "yellow_cards": max(0, fouls), "timeouts": 0,
         "timeout_time": 0, "goalkeeper": 0}
        for name, score, fouls in news.teams
    )  # fmt: skip
    return encode(
        {
            "packet_timestamp": round(1e6 * news.time), "stage": news.stage,
            "stage_time_left": None if news.left is None else round(1e6 * news.left), "command": news.command,
            "command_counter": news.counter, "command_timestamp": round(1e6 * news.since),
            **dict(zip(COLOURS, teams, strict=False)), "source_identifier": "VRG", "status_message": news.words or None,
        },
        REFEREE,
    )  # fmt: skip
