"""Packets of the Small Size League: round trips, foreign bytes, and what another implementation makes of them."""

import json
import math
import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import MessageError
from vrg.localisation.ssl.layouts import REFEREE, TRACKER, WRAPPER
from vrg.localisation.ssl.packets import (
    RefereeNews,
    Seen,
    SeenRobot,
    read_tracker,
    read_vision,
    referee_packet,
    tracker_packet,
    vision_packet,
)
from vrg.localisation.ssl.wire import Field, Kind, decode, encode
from vrg.types import Twist

coordinates = st.floats(-20.0, 20.0, width=32)
robots = st.lists(
    st.builds(
        SeenRobot,
        st.sampled_from(["yellow", "blue"]),
        st.integers(0, 15),
        coordinates,
        coordinates,
        st.none() | st.floats(-4.0, 4.0, width=32),
        st.floats(0.0, 1.0, width=32),
    ),
    max_size=8,
)
times = st.floats(1.7e9, 1.9e9)
DETECTION = {"frame_number": 1, "t_capture": 1.0, "t_sent": 1.0, "camera_id": 0, "robots_yellow": []}
"""What a detection without robots holds."""


@given(times, times, st.integers(0, 7), robots)
def test_what_vision_has_seen_comes_back(captured: float, sent: float, camera: int, seen: list[SeenRobot]) -> None:
    found = read_vision(vision_packet(7, Seen(captured, sent, seen, camera), (9.0, 6.0)))
    assert found is not None
    assert (found.captured, found.sent, found.camera) == (captured, sent, camera)
    wanted = sorted(seen, key=lambda robot: robot.colour == "blue")
    for one, other in zip(wanted, found.robots, strict=True):
        assert (one.colour, one.number, one.heading, one.confidence) == (
            other.colour, other.number, other.heading, other.confidence,
        )  # fmt: skip
        assert (one.x, one.y) == pytest.approx((other.x, other.y), abs=2e-6)


@given(times, robots.map(lambda seen: [robot for robot in seen if robot.heading is not None]))
def test_what_a_tracker_has_seen_comes_back(captured: float, seen: list[SeenRobot]) -> None:
    found = read_tracker(tracker_packet(7, Seen(captured, captured, seen), "a-b-c", "VRG"))
    assert found == Seen(captured, captured, seen)


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for read in (read_vision, read_tracker):
        try:
            read(data)
        except MessageError:
            continue


@given(st.integers(-(2**63), 2**63 - 1), st.integers(0, 2**64 - 1), st.text(), st.floats(width=32, allow_nan=False))
def test_values_of_every_kind_come_back(number: int, count: int, text: str, share: float) -> None:
    layout = {
        1: Field("int", Kind.INT),
        2: Field("uint", Kind.UINT),
        300: Field("sint", Kind.SINT),
        4: Field("text", Kind.TEXT),
        5: Field("shares", Kind.FLOAT, many=True),
        6: Field("inner", {1: Field("uint", Kind.UINT)}),
    }
    text = text.encode(errors="ignore").decode()
    values: dict[str, object] = {"int": number, "uint": count, "sint": number, "text": text}
    values |= {"shares": [share, share], "inner": {"uint": 3}}
    assert decode(encode(values, layout), layout) == values
    # A reader that knows less leaves out the rest.
    assert decode(encode(values, layout), {4: layout[4]}) == {"text": text}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"x": math.nan, "y": 0.0}, "x: expected a number of at most .*, got nan"),
        ({"x": 2e6, "y": 0.0}, "x: expected a number of at most"),
        ({"x": 1.0}, "y: expected it, found none"),
    ],
)
def test_numbers_that_cannot_be_are_refused(values: dict[str, float], words: str) -> None:
    robot = {"confidence": 1.0, "robot_id": 1, **values}
    with pytest.raises(MessageError, match=words):
        read_vision(encode({"detection": DETECTION | {"robots_blue": [robot]}}, WRAPPER))


def test_a_robot_without_a_number_and_packets_without_robots_are_nothing() -> None:
    seen = read_vision(encode({"detection": DETECTION | {"robots_blue": [{"x": 1.0, "y": 1.0}]}}, WRAPPER))
    assert seen is not None
    assert seen.robots == []
    assert read_vision(encode({"geometry": {"field": {"field_length": 9000, "field_lines": []}}}, WRAPPER)) is None
    for data in (b"", encode({"uuid": "a"}, TRACKER), vision_packet(1, Seen(1.0, 1.0, []))):
        with pytest.raises(MessageError, match="expected the packet of a tracker"):
            read_tracker(data)


def test_the_state_of_a_match_is_a_packet_of_the_game_controller() -> None:
    news = RefereeNews(1.5e9, 1, 2, 3, 1.4e9, -2.5, [("red", 2, 1), ("blue", 0, 0)], "ann is tagged by bob")
    found = decode(referee_packet(news), REFEREE)
    assert found["packet_timestamp"] == 1_500_000_000_000_000
    assert found["stage_time_left"] == -2_500_000
    assert (found["stage"], found["command"], found["command_counter"]) == (1, 2, 3)
    assert (found["yellow"]["name"], found["yellow"]["score"], found["yellow"]["yellow_cards"]) == ("red", 2, 1)
    assert found["status_message"] == "ann is tagged by bob"


OTHER = """
import json, sys
from sslclient import messages_robocup_ssl_wrapper_pb2 as ssl
packet = ssl.SSL_WrapperPacket.FromString(sys.stdin.buffer.read())
d, field = packet.detection, packet.geometry.field
sys.stdout.write(json.dumps({
    "captured": d.t_capture, "camera": d.camera_id, "length": field.field_length,
    "lines": [line.name for line in field.field_lines],
    "yellow": [[r.robot_id, r.x, r.y, r.orientation] for r in d.robots_yellow],
    "blue": [[r.robot_id, r.x, r.y, r.HasField("orientation")] for r in d.robots_blue],
}) + "\\n")
other = ssl.SSL_WrapperPacket()
other.detection.frame_number, other.detection.t_capture, other.detection.t_sent = 5, 1.25, 1.5
other.detection.camera_id = 2
robot = other.detection.robots_blue.add()
robot.confidence, robot.robot_id, robot.x, robot.y, robot.orientation = 0.75, 11, 1500.0, -250.0, 0.5
robot.pixel_x = robot.pixel_y = 1.0
sys.stdout.write(other.SerializeToString().hex())
"""


def test_another_implementation_reads_what_vrg_writes_and_the_other_way_round() -> None:
    """`sslclient` has the league's own definitions, compiled for an older protobuf, which needs the slower reader."""
    robots = [
        SeenRobot("yellow", 3, 1.5, -2.0, 0.25, twist=Twist(1.0, 0.0)),
        SeenRobot("blue", 12, -4.0, 3.0, None),
    ]
    packet = vision_packet(9, Seen(1.7e9 + 0.5, 1.7e9 + 0.6, robots, 1), (9.0, 6.0))
    done = subprocess.run(
        [sys.executable, "-c", OTHER], input=packet, capture_output=True, timeout=120, check=False,
        env={**os.environ, "PROTOCOL_BUFFERS_PYTHON_IMPLEMENTATION": "python"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()
    told, other = done.stdout.decode().split("\n")
    assert json.loads(told) == {
        "captured": 1.7e9 + 0.5,
        "camera": 1,
        "length": 9000,
        "lines": ["TopTouchLine", "BottomTouchLine", "LeftGoalLine", "RightGoalLine", "HalfwayLine"],
        "yellow": [[3, 1500.0, -2000.0, 0.25]],
        "blue": [[12, -4000.0, 3000.0, False]],
    }
    seen = read_vision(bytes.fromhex(other))
    assert seen == Seen(1.25, 1.5, [SeenRobot("blue", 11, 1.5, -0.25, 0.5, 0.75)], 2)
