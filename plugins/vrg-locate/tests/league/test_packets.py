"""Packets of the Small Size League: what is in them comes back, foreign bytes, and another implementation's."""

import math
import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from league.league import encode, tracker_packet, vision_packet
from vrg.errors import MessageError
from vrg_locate.ssl.packets import TRACKER, WRAPPER, Seen, SeenBall, SeenRobot, read_tracker, read_vision
from vrg_locate.ssl.wire import Field, Kind, decode

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
balls = st.lists(st.builds(SeenBall, coordinates, coordinates, st.floats(0.0, 1.0, width=32)), max_size=4).map(tuple)
times = st.floats(1.7e9, 1.9e9)
DETECTION = {"t_capture": 1.0, "t_sent": 1.0, "camera_id": 0, "robots_yellow": []}
"""What a detection without robots holds."""
GEOMETRY = b"\x12\x05\x0a\x03\x08\xa8\x46"
"""A packet of vision with the length of the field, 9000 mm, alone."""
TRACKER_WITHOUT_FRAME = b"\x0a\x01a"
"""A packet of a tracker with its name alone."""


@given(times, times, st.integers(0, 7), robots, balls)
def test_what_vision_has_seen_comes_back(
    captured: float, sent: float, camera: int, seen: list[SeenRobot], rolling: tuple[SeenBall, ...]
) -> None:
    found = read_vision(vision_packet(Seen(captured, sent, seen, camera, rolling)))
    assert found is not None
    assert (found.captured, found.sent, found.camera) == (captured, sent, camera)
    wanted = sorted(seen, key=lambda robot: robot.colour == "blue")
    for one, other in zip(wanted, found.robots, strict=True):
        assert (one.colour, one.number, one.heading, one.confidence) == (
            other.colour, other.number, other.heading, other.confidence,
        )  # fmt: skip
        assert (one.x, one.y) == pytest.approx((other.x, other.y), abs=2e-6)
    for ball, read in zip(rolling, found.balls, strict=True):
        assert (ball.x, ball.y, ball.confidence) == pytest.approx((read.x, read.y, read.confidence), abs=2e-6)


@given(times, robots.map(lambda seen: [robot for robot in seen if robot.heading is not None]), balls)
def test_what_a_tracker_has_seen_comes_back(
    captured: float, seen: list[SeenRobot], rolling: tuple[SeenBall, ...]
) -> None:
    found = read_tracker(tracker_packet(Seen(captured, captured, seen, balls=rolling)))
    assert found == Seen(captured, captured, seen, balls=rolling)


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for read in (read_vision, read_tracker):
        try:
            read(data)
        except MessageError:
            continue


@given(st.integers(0, 2**64 - 1), st.floats(allow_nan=False), st.floats(width=32, allow_nan=False))
def test_values_of_every_kind_come_back(count: int, time: float, share: float) -> None:
    layout = {
        2: Field("uint", Kind.UINT),
        300: Field("time", Kind.DOUBLE),
        5: Field("shares", Kind.FLOAT, many=True),
        6: Field("inner", {1: Field("uint", Kind.UINT)}),
    }
    values: dict[str, object] = {"uint": count, "time": time, "shares": [share, share], "inner": {"uint": 3}}
    assert decode(encode(values, layout), layout) == values
    # A reader that knows less leaves out the rest.
    assert decode(encode(values, layout), {300: layout[300]}) == {"time": time}


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
    for field in ("robots_blue", "balls"):
        with pytest.raises(MessageError, match=words):
            read_vision(encode({"detection": DETECTION | {field: [robot]}}, WRAPPER))
    with pytest.raises(MessageError, match=words):
        read_tracker(
            encode(
                {"tracked_frame": {"timestamp": 1.0, "balls": [{"pos": {k: v / 1000.0 for k, v in values.items()}}]}},
                TRACKER,
            )
        )


def test_a_robot_without_a_number_and_packets_without_robots_are_nothing() -> None:
    seen = read_vision(encode({"detection": DETECTION | {"robots_blue": [{"x": 1.0, "y": 1.0}]}}, WRAPPER))
    assert seen is not None
    assert seen.robots == []
    assert read_vision(GEOMETRY) is None
    for data in (b"", TRACKER_WITHOUT_FRAME, vision_packet(Seen(1.0, 1.0, []))):
        with pytest.raises(MessageError, match="expected the packet of a tracker"):
            read_tracker(data)


OTHER = """
import sys
from sslclient import messages_robocup_ssl_wrapper_pb2 as ssl
packet = ssl.SSL_WrapperPacket()
packet.geometry.field.field_length = 9000
packet.detection.frame_number, packet.detection.t_capture, packet.detection.t_sent = 5, 1.25, 1.5
packet.detection.camera_id = 2
robot = packet.detection.robots_blue.add()
robot.confidence, robot.robot_id, robot.x, robot.y, robot.orientation = 0.75, 11, 1500.0, -250.0, 0.5
robot.pixel_x = robot.pixel_y = 1.0
ball = packet.detection.balls.add()
ball.confidence, ball.area, ball.x, ball.y, ball.z = 0.5, 30, -750.0, 125.0, 10.0
ball.pixel_x = ball.pixel_y = 2.0
for field in ("field_width", "goal_width", "goal_depth", "boundary_width"):
    setattr(packet.geometry.field, field, 1)
sys.stdout.write(packet.SerializeToString().hex())
"""


def test_packets_of_another_implementation_are_read() -> None:
    """`sslclient` has the league's own definitions, compiled for an older protobuf, which needs the slower reader."""
    done = subprocess.run(
        [sys.executable, "-c", OTHER], capture_output=True, timeout=120, check=False,
        env={**os.environ, "PROTOCOL_BUFFERS_PYTHON_IMPLEMENTATION": "python"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()
    seen = read_vision(bytes.fromhex(done.stdout.decode()))
    assert seen == Seen(1.25, 1.5, [SeenRobot("blue", 11, 1.5, -0.25, 0.5, 0.75)], 2, (SeenBall(-0.75, 0.125, 0.5),))
