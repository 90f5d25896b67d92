"""What a robot that runs ROS 2 reports: how old it is, and where its odometry goes."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.errors import MessageError
from vrg.hal.models import robot_model
from vrg.hal.sensors.battery import Battery
from vrg.hal.sensors.laser import Laser
from vrg.hal.sensors.odometry import Odometry
from vrg.types import STILL, Pose, Twist
from vrg_ros import messages as ros
from vrg_ros.cdr import decode, encode
from vrg_ros.reported import Reported

MODEL = robot_model("TurtleBot3")


def odometry(at: float, pose: Pose = Pose(0.0, 0.0, 0.0), twist: Twist = STILL) -> dict[str, Any]:  # noqa: B008
    """As it comes out of its bytes."""
    return decode("nav_msgs/Odometry", encode("nav_msgs/Odometry", ros.odometry(at, "r", pose, twist)))


def turned(**turn: float) -> dict[str, Any]:
    message = odometry(1.0)
    message["pose"]["pose"]["orientation"] = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0} | turn
    return message


def place(reported: Reported, now: float) -> Pose:
    (value,) = [s.value for s in reported.samples(now, now) if isinstance(s.value, Odometry)]
    return value.pose


@given(boot=st.floats(1.0, 1e9), delays=st.lists(st.floats(0.0, 0.4), min_size=3, max_size=20))
def test_a_message_is_as_old_as_it_was_later_than_the_quickest(boot: float, delays: list[float]) -> None:
    """Whatever the robot's clock reads, and whatever way all messages have in common."""
    reported = Reported(MODEL)
    for number, delay in enumerate(delays):
        sent = 0.5 * number
        reported.odometry(odometry(boot + sent), sent + delay)
        assert reported.age(sent + delay) == pytest.approx(delay - min(delays[: number + 1]), abs=1e-6)
    late = delays[-1] - min(delays)
    assert reported.age(0.5 * number + delays[-1] + 2.0) == pytest.approx(2.0 + late, abs=1e-6)


AGES: dict[str, tuple[list[tuple[float, float]], float, float]] = {
    "a driver that repeats itself": ([(5.0, 0.1 * n) for n in range(20)], 1.9, 1.9),
    "messages that come late for a long time stay late": (
        [(100.0 + 0.1 * n, 0.1 * n + (0.6 if n > 10 else 0.0)) for n in range(60)], 6.5, 0.6,
    ),
    "old ones that alternate": ([(100.0 - 0.5 * (n % 2), 0.1 * n) for n in range(60)], 5.9, 5.9),
    "one that was overtaken hides no silence": (
        [*((100.0 + 0.1 * n, 0.1 * n) for n in range(10)), (99.95, 1.0)], 1.5, 0.6,
    ),
}  # fmt: skip
"""Messages by their stamps and when they come, a time, and how old the newest then is."""


@pytest.mark.parametrize(("messages", "now", "age"), AGES.values(), ids=AGES)
def test_how_old_the_newest_message_is(messages: list[tuple[float, float]], now: float, age: float) -> None:
    reported = Reported(MODEL)
    for stamp, comes in messages:
        reported.odometry(odometry(stamp), comes)
    assert reported.age(now) == pytest.approx(age)


def test_a_simulated_clock_that_stands_still_and_falls_behind_makes_no_message_old() -> None:
    reported, simulated = Reported(MODEL), Reported(MODEL, simulated=True)
    for number in range(60):
        # It stands still for 2 s, and then runs at a third of real time.
        at, now = (
            (100.0 + 0.1 * number, 0.1 * number) if number < 20 else (102.0 + (number - 20) / 30, 2.0 + 0.1 * number)
        )
        for each in (reported, simulated):
            each.odometry(odometry(at), now)
        assert simulated.age(now) == simulated.delay() == 0.0
        assert (reported.delay() >= 2.0) == (number >= 20)
    assert simulated.age(now + 0.6) == pytest.approx(0.6)
    simulated.odometry(odometry(at), now + 0.6)
    assert simulated.age(now + 0.6) == pytest.approx(0.6), "it repeats itself"


def test_a_clock_that_is_set_back_is_followed() -> None:
    reported = Reported(MODEL)
    reported.odometry(odometry(1000.0, Pose(1.0, 0.0, 0.0)), 0.0)
    reported.odometry(odometry(10.0, Pose(1.01, 0.0, 0.0)), 0.1)
    assert reported.age(0.1) == pytest.approx(0.0)
    assert place(reported, 0.1) == Pose(0.0, 0.0, 0.0)


def test_a_scan_of_a_clock_that_is_ahead_grows_old_all_the_same() -> None:
    reported = Reported(MODEL)
    reported.odometry(odometry(10.0), 0.0)
    reported.scan(ros.scan(1e6, "laser", 0.0, 0.1, 3.5, [1.0]) | {"range_min": 0.1}, 0.0)
    (scan,) = [sample for sample in reported.samples(2.0, 2.0) if isinstance(sample.value, Laser)]
    assert scan.age == 2.0


@given(turns=st.lists(st.floats(-0.3, 0.3), min_size=1, max_size=60), start=st.floats(-3.0, 3.0))
def test_the_way_begins_at_zero_and_turns_beyond_pi(turns: list[float], start: float) -> None:
    reported, heading = Reported(MODEL), start
    reported.odometry(odometry(1.0, Pose(7.0, -2.0, start)), 0.0)
    assert place(reported, 0.0) == Pose(0.0, 0.0, 0.0)
    for number, turn in enumerate(turns, 1):
        heading += turn
        reported.odometry(odometry(1.0 + 0.1 * number, Pose(7.0, -2.0, heading)), 0.1 * number)
    assert place(reported, 10.0).theta == pytest.approx(sum(turns), abs=1e-6)


def test_the_way_goes_on_where_the_robot_was_when_its_odometry_begins_anew() -> None:
    reported = Reported(MODEL)
    for number, x in enumerate((0.0, 0.02, 0.04)):
        reported.odometry(odometry(1.0 + 0.1 * number, Pose(3.0 + x, 0.0, 0.0)), 0.1 * number)
    reported.odometry(odometry(1.3, Pose(0.0, 0.0, 0.0)), 0.3)
    reported.odometry(odometry(1.4, Pose(0.02, 0.0, 0.0)), 0.4)
    assert place(reported, 0.4).x == pytest.approx(0.06)


def test_a_robot_that_was_away_for_long_and_began_anew_stands_where_it_was() -> None:
    reported = Reported(MODEL)
    for number in range(20):
        reported.odometry(odometry(1.0 + 0.1 * number, Pose(0.02 * number, 0.0, 0.0)), 0.1 * number)
    assert reported.odometry(odometry(13.0, Pose(-2.0, 0.0, 0.0)), 12.0)
    assert reported.odometry(odometry(1e6, Pose(5.0, 0.0, 0.0)), 13.0)
    assert place(reported, 13.0).x == pytest.approx(0.38)
    assert not reported.jumps(13.0)


def test_two_nodes_that_publish_odometry_are_found_out() -> None:
    reported = Reported(MODEL)
    for number in range(6):
        reported.odometry(odometry(1.0 + 0.1 * number, Pose(5.0 * (number % 2), 0.0, 0.0)), 0.1 * number)
    assert reported.jumps(0.6)
    assert not reported.jumps(20.0)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (odometry(0.0), "with a time stamp"),
        (odometry(1.0, Pose(math.nan, 0.0, 0.0)), "expected Odometry"),
        (odometry(1.0, Pose(1e200, 0.0, 0.0)), "expected Odometry"),
        (odometry(1.0, twist=Twist(math.inf, 0.0)), "expected Odometry"),
        (turned(z=0.0, w=0.0), "a quaternion of length 1"),
        (turned(y=1e200, w=1.0), "a quaternion of length 1"),
        (turned(z=math.nan, w=1.0), "a quaternion of length 1"),
    ],
)
def test_what_is_no_odometry_is_refused_in_words(message: dict[str, Any], words: str) -> None:
    with pytest.raises(MessageError, match=words):
        Reported(MODEL).odometry(message, 0.0)


def test_odometry_of_another_frame_is_refused() -> None:
    with pytest.raises(MessageError, match="expected odometry of the frame base_footprint, got 'r/base_link'"):
        Reported(MODEL, "base_footprint").odometry(odometry(1.0), 0.0)


@given(
    ranges=st.lists(st.floats(width=32), min_size=1, max_size=30),
    shortest=st.floats(0.0, 0.5, width=32),
    yaw=st.floats(-math.pi, math.pi),
)
def test_every_scan_that_can_be_decoded_has_finite_ranges(ranges: list[float], shortest: float, yaw: float) -> None:
    reported = Reported(MODEL, scan_yaw=yaw)
    reported.odometry(odometry(1.0), 0.0)
    message = ros.scan(1.0, "laser", 0.0, 0.1, 3.5, ranges) | {"ranges": ranges, "range_min": shortest}
    reported.scan(decode("sensor_msgs/LaserScan", encode("sensor_msgs/LaserScan", message)), 0.0)
    (scan,) = [s.value for s in reported.samples(0.0, 0.0) if isinstance(s.value, Laser)]
    assert scan.angle_min == pytest.approx(yaw)
    assert all(r == 0.0 or shortest <= r <= 3.5 for r in scan.ranges)


def test_a_beam_that_has_measured_nothing_or_something_too_near_has_found_no_free_ground() -> None:
    reported = Reported(MODEL)
    reported.odometry(odometry(1.0), 0.0)
    ranges = [1.0, math.inf, 9.0, math.nan, 0.0, -1.0, 0.0625, -math.inf]
    message = ros.scan(1.0, "laser", 0.0, 0.1, 3.5, ranges) | {"ranges": ranges, "range_min": 0.125}
    reported.scan(message, 0.0)
    (scan,) = [s.value for s in reported.samples(0.0, 0.0) if isinstance(s.value, Laser)]
    assert scan.ranges.tolist() == [1.0, 3.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.125]
    assert scan.words == "8 beams, 2 met something; nearest 0.12 m at +40°"


def test_a_charge_is_a_share_or_in_per_cent_but_never_both() -> None:
    def charges(*reported: float) -> list[float]:
        robot, found = Reported(MODEL), []
        robot.odometry(odometry(1.0), 0.0)
        for percentage in reported:
            robot.battery({"header": ros.header(1.0, ""), "percentage": percentage}, 0.0)
            found += [s.value.charge for s in robot.samples(0.0, 0.0) if isinstance(s.value, Battery)]
        return found

    assert charges(0.5, 1.0) == [0.5, 1.0]
    assert charges(50.0, 1.0) == [0.5, 0.01]
    assert charges(1.02, 0.98) == [1.0, 0.98], "a fresh battery holds a little more than it is taken to"
    assert charges(math.nan, -1.0) == []


@pytest.mark.parametrize(
    "wrong", [{"angle_increment": 0.0}, {"ranges": []}, {"range_min": math.inf}, {"range_max": math.inf}]
)
def test_a_scan_that_no_laser_makes_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match="expected a scan"):
        Reported(MODEL).scan(ros.scan(1.0, "laser", 0.0, 0.1, 3.5, [1.0]) | {"range_min": 0.1} | wrong, 0.0)
