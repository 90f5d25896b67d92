"""The messages of the Small Size League that VRG reads and writes, by their fields.

Names and numbers are those of the league's definitions (github.com/RoboCup-SSL: ssl-vision, ssl-game-controller), read
in 2026. Lengths of vision are in millimetres, those of the tracker in metres; angles in rad; times in s since 1970.
"""

from typing import Final

from vrg.localisation.ssl.wire import Field, Kind, Layout

_POINT: Final[Layout] = {1: Field("x", Kind.FLOAT), 2: Field("y", Kind.FLOAT)}

_SEEN_ROBOT: Final[Layout] = {
    1: Field("confidence", Kind.FLOAT),
    2: Field("robot_id", Kind.UINT),
    3: Field("x", Kind.FLOAT),
    4: Field("y", Kind.FLOAT),
    5: Field("orientation", Kind.FLOAT),
    6: Field("pixel_x", Kind.FLOAT),
    7: Field("pixel_y", Kind.FLOAT),
}
_DETECTION: Final[Layout] = {
    1: Field("frame_number", Kind.UINT),
    2: Field("t_capture", Kind.DOUBLE),
    3: Field("t_sent", Kind.DOUBLE),
    4: Field("camera_id", Kind.UINT),
    6: Field("robots_yellow", _SEEN_ROBOT, many=True),
    7: Field("robots_blue", _SEEN_ROBOT, many=True),
}
_LINE: Final[Layout] = {
    1: Field("name", Kind.TEXT),
    2: Field("p1", _POINT),
    3: Field("p2", _POINT),
    4: Field("thickness", Kind.FLOAT),
}
_FIELD: Final[Layout] = {
    1: Field("field_length", Kind.INT),
    2: Field("field_width", Kind.INT),
    3: Field("goal_width", Kind.INT),
    4: Field("goal_depth", Kind.INT),
    5: Field("boundary_width", Kind.INT),
    6: Field("field_lines", _LINE, many=True),
}
WRAPPER: Final[Layout] = {1: Field("detection", _DETECTION), 2: Field("geometry", {1: Field("field", _FIELD)})}
"""SSL_WrapperPacket, which vision sends."""

_TRACKED_ROBOT: Final[Layout] = {
    1: Field("robot_id", {1: Field("id", Kind.UINT), 2: Field("team", Kind.UINT)}),
    2: Field("pos", _POINT),
    3: Field("orientation", Kind.FLOAT),
    4: Field("vel", _POINT),
    5: Field("vel_angular", Kind.FLOAT),
    6: Field("visibility", Kind.FLOAT),
}
TRACKER: Final[Layout] = {
    1: Field("uuid", Kind.TEXT),
    2: Field("source_name", Kind.TEXT),
    3: Field(
        "tracked_frame",
        {
            1: Field("frame_number", Kind.UINT),
            2: Field("timestamp", Kind.DOUBLE),
            4: Field("robots", _TRACKED_ROBOT, many=True),
        },
    ),
}
"""TrackerWrapperPacket, which trackers of vision send."""

_TEAM: Final[Layout] = {
    1: Field("name", Kind.TEXT),
    2: Field("score", Kind.UINT),
    3: Field("red_cards", Kind.UINT),
    5: Field("yellow_cards", Kind.UINT),
    6: Field("timeouts", Kind.UINT),
    7: Field("timeout_time", Kind.UINT),
    8: Field("goalkeeper", Kind.UINT),
}
REFEREE: Final[Layout] = {
    1: Field("packet_timestamp", Kind.UINT),
    2: Field("stage", Kind.UINT),
    3: Field("stage_time_left", Kind.SINT),
    4: Field("command", Kind.UINT),
    5: Field("command_counter", Kind.UINT),
    6: Field("command_timestamp", Kind.UINT),
    7: Field("yellow", _TEAM),
    8: Field("blue", _TEAM),
    18: Field("source_identifier", Kind.TEXT),
    20: Field("status_message", Kind.TEXT),
}
"""Referee, which the game controller sends."""
