"""Messages of ROS 2 as bytes; `test_wire` lets another implementation read one of each type."""

import math

import pytest

from vrg.errors import MessageError
from vrg_ros.cdr import HASHES, RIHS_PREFIX, decode, encode

HEADER = b"\x00\x01\x00\x00"


def test_hashes_are_those_that_the_nodes_of_jazzy_have() -> None:
    assert all(known.startswith(RIHS_PREFIX) for known in HASHES.values())
    for kind, known in (
        ("geometry_msgs/Twist", "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"),
        ("nav_msgs/Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"),
        ("std_msgs/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
    ):
        assert HASHES[kind] == RIHS_PREFIX + known


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("sensor_msgs/LaserScan", {"angle_min": -1.5, "range_max": 8.0, "ranges": [0.5, math.inf, 2.0]}),
        ("nav_msgs/OccupancyGrid", {"info": {"resolution": 0.5, "width": 3, "height": 1}, "data": [0, 100, -1]}),
        ("tf2_msgs/TFMessage", {"transforms": [{"child_frame_id": "a"}, {"transform": {"rotation": {"w": 1.0}}}]}),
        ("visualization_msgs/MarkerArray", {"markers": [{"text": "grüezi", "points": [{"x": 1.0}, {"z": 2.0}]}]}),
        ("sensor_msgs/BatteryState", {"percentage": 0.5, "present": True, "cell_voltage": []}),
    ],
)
def test_what_was_written_is_read(kind: str, message: dict[str, object]) -> None:
    found = decode(kind, encode(kind, message))
    assert encode(kind, found) == encode(kind, message)
    assert holds(found, message)


def holds(found: object, wanted: object) -> bool:
    """Whether all that is wanted is there, besides what is left out."""
    if isinstance(wanted, dict):
        return isinstance(found, dict) and all(holds(found[name], value) for name, value in wanted.items())
    if isinstance(wanted, list):
        return isinstance(found, list) and len(found) == len(wanted) and all(map(holds, found, wanted))
    return found == wanted


def test_a_field_that_is_left_out_is_zero_or_empty() -> None:
    said = {"header": {"frame_id": "map"}}
    found = decode("nav_msgs/Odometry", encode("nav_msgs/Odometry", said))
    assert found["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}
    assert found["pose"]["covariance"] == [0.0] * 36
    assert encode("std_msgs/String", {"data": "hi"}).hex() == "00010000" + "03000000" + "686900"


def test_what_is_no_such_message_is_refused() -> None:
    for data in (
        b"",
        HEADER,
        HEADER + b"\xff\xff\xff\xff",
        HEADER + b"\x02\0\0\0\xff\0",
        b"\0\0\0\0\x03\0\0\0hi\0",
        encode("std_msgs/String", {})[:-1],
    ):
        with pytest.raises(MessageError, match="std_msgs/String"):
            decode("std_msgs/String", data)
    for kind in ("tf2_msgs/TFMessage", "sensor_msgs/LaserScan"):
        with pytest.raises(MessageError, match=kind):
            decode(kind, HEADER + b"\xff" * 60)
    with pytest.raises(MessageError, match="rosgraph_msgs/Clock"):
        decode("rosgraph_msgs/Clock", HEADER + bytes(16))
    for wrong in ({"data": 3}, {"date": "x"}):
        with pytest.raises(ValueError, match="std_msgs/String"):
            encode("std_msgs/String", wrong)
    with pytest.raises(ValueError, match="rosgraph_msgs/Clock"):
        encode("rosgraph_msgs/Clock", {"clock": {"sec": 1 << 40}})
    with pytest.raises(ValueError, match="expected 36 values, got 2"):
        encode("nav_msgs/Odometry", {"pose": {"covariance": [1.0, 2.0]}})
    assert math.isnan(decode("sensor_msgs/Range", encode("sensor_msgs/Range", {"range": math.nan}))["range"])
