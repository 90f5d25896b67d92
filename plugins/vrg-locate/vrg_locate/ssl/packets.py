"""The packets of the vision and of the trackers of the Small Size League, and what is in them, in SI units.

The frame is that of the league's field: its origin is in the middle, x along its length. Numbers that cannot be raise
errors. The names and numbers of fields are those of the league's definitions (github.com/RoboCup-SSL: ssl-vision,
ssl-game-controller), read in 2026; what is not needed is left out. There, lengths of vision are in millimetres, those
of the tracker in metres; angles in rad; times in s since 1970.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from vrg.errors import MessageError
from vrg_locate.ssl.wire import Field, Kind, Layout, decode

Colour = Literal["yellow", "blue"]
COLOURS: Final[tuple[Colour, Colour]] = ("yellow", "blue")
_TEAMS: Final[Mapping[int, Colour]] = {1: "yellow", 2: "blue"}
_FAR: Final = 1e3
"""The coordinate in m beyond which no field reaches."""

_SEEN_ROBOT: Final[Layout] = {
    1: Field("confidence", Kind.FLOAT),
    2: Field("robot_id", Kind.UINT),
    3: Field("x", Kind.FLOAT),
    4: Field("y", Kind.FLOAT),
    5: Field("orientation", Kind.FLOAT),
}
_SEEN_BALL: Final[Layout] = {
    1: Field("confidence", Kind.FLOAT),
    3: Field("x", Kind.FLOAT),
    4: Field("y", Kind.FLOAT),
}
_DETECTION: Final[Layout] = {
    2: Field("t_capture", Kind.DOUBLE),
    3: Field("t_sent", Kind.DOUBLE),
    4: Field("camera_id", Kind.UINT),
    5: Field("balls", _SEEN_BALL, many=True),
    6: Field("robots_yellow", _SEEN_ROBOT, many=True),
    7: Field("robots_blue", _SEEN_ROBOT, many=True),
}
WRAPPER: Final[Layout] = {1: Field("detection", _DETECTION)}
"""SSL_WrapperPacket, which vision sends: the robots and balls of a picture, or the geometry of the field."""

_TRACKED_PLACE: Final[Layout] = {1: Field("x", Kind.FLOAT), 2: Field("y", Kind.FLOAT)}
_TRACKED_BALL: Final[Layout] = {1: Field("pos", _TRACKED_PLACE), 3: Field("visibility", Kind.FLOAT)}
_TRACKED_ROBOT: Final[Layout] = {
    1: Field("robot_id", {1: Field("id", Kind.UINT), 2: Field("team", Kind.UINT)}),
    2: Field("pos", _TRACKED_PLACE),
    3: Field("orientation", Kind.FLOAT),
    6: Field("visibility", Kind.FLOAT),
}
_TRACKED_FRAME: Final[Layout] = {
    2: Field("timestamp", Kind.DOUBLE),
    3: Field("balls", _TRACKED_BALL, many=True),
    4: Field("robots", _TRACKED_ROBOT, many=True),
}
TRACKER: Final[Layout] = {3: Field("tracked_frame", _TRACKED_FRAME)}
"""TrackerWrapperPacket, which trackers of vision send."""


@dataclass(frozen=True)
class SeenRobot:
    """A robot in a packet.

    Args:
        colour, number: which one it is. x, y: m. heading: rad; None if it was not seen.
        confidence: how sure the sender is of it, 0 to 1.
    """

    colour: Colour
    number: int
    x: float
    y: float
    heading: float | None
    confidence: float = 1.0


@dataclass(frozen=True)
class SeenBall:
    """A ball in a packet, whose height is not looked at.

    Args:
        x, y: m. confidence: how sure the sender is of it, 0 to 1.
    """

    x: float
    y: float
    confidence: float = 1.0


@dataclass(frozen=True)
class Seen:
    """The robots and balls that were seen at one instant.

    Args:
        captured, sent: when the picture was taken, and when the packet was sent, by the sender's clock, s.
        camera: the number of the camera; 0 for a tracker.
    """

    captured: float
    sent: float
    robots: Sequence[SeenRobot]
    camera: int = 0
    balls: Sequence[SeenBall] = ()


def read_vision(data: bytes) -> Seen | None:
    """The robots and balls in a packet of vision; None if it has the geometry of the field alone.

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
            *_place(one, 1000.0),
            _angle(one),
            _share(one, "confidence"),
        )
        for colour in COLOURS
        for one in frame[f"robots_{colour}"]
        if "robot_id" in one  # a robot whose pattern was not recognised has none
    ]
    balls = tuple(SeenBall(*_place(one, 1000.0), _share(one, "confidence")) for one in frame["balls"])
    return Seen(_time(frame, "t_capture"), _time(frame, "t_sent"), robots, frame.get("camera_id", 0), balls)


def read_tracker(data: bytes) -> Seen:
    """The robots and balls in a packet of a tracker.

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
            robots.append(SeenRobot(colour, _needed(robot, "id"), *_place(at), _angle(one), _share(one, "visibility")))
    balls = tuple(SeenBall(*_place(one.get("pos", {})), _share(one, "visibility")) for one in frame["balls"])
    time = _time(frame, "timestamp")
    return Seen(time, time, robots, balls=balls)


def _needed(table: Mapping[str, Any], name: str) -> Any:
    if name not in table:
        raise MessageError(f"{name}: expected it, found none")
    return table[name]


def _number(table: Mapping[str, Any], name: str, most: float) -> float:
    value = float(_needed(table, name))
    if not abs(value) <= most:
        raise MessageError(f"{name}: expected a number of at most {most:g}, got {value}")
    return value


def _place(table: Mapping[str, Any], metre: float = 1.0) -> tuple[float, float]:
    """The coordinates in m, of which each metre is so many units."""
    return _number(table, "x", metre * _FAR) / metre, _number(table, "y", metre * _FAR) / metre


def _time(table: Mapping[str, Any], name: str) -> float:
    return _number(table, name, 1e11)


def _share(table: Mapping[str, Any], name: str) -> float:
    return min(1.0, max(0.0, _number(table, name, 1e6))) if name in table else 1.0


def _angle(table: Mapping[str, Any]) -> float | None:
    return _number(table, "orientation", 1e4) if "orientation" in table else None
