"""A scan on the map, against numbers worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrg.agents.perception.scan import Scan, make_scan, scan_of
from vrg.geometry import along_arc
from vrg.hal.models.lms200 import lms200
from vrg.hal.sensors.depiction import Rays
from vrg.hal.sensors.laser import Laser
from vrg.types import Pose, Twist

QUARTER = math.pi / 2
ORIGIN = Pose(0.0, 0.0, 0.0)


def scan(ranges: object, pose: Pose = ORIGIN, mount: float = 0.0) -> Scan:
    """Three beams: to the right, straight ahead and to the left, if there are three ranges."""
    return make_scan(ranges, pose, mount=mount, angle_min=-QUARTER, angle_step=QUARTER, range_max=8.0)


def test_right_ahead_and_left_of_a_robot_at_the_origin() -> None:
    assert scan([1.0, 2.0, 3.0]).points == pytest.approx(np.array([[0, -1], [2, 0], [0, 3]]), abs=1e-12)


def test_a_robot_that_heads_north_and_has_its_laser_in_front() -> None:
    """The laser is 0.5 m north of the centre. To its right is east, ahead is north, and to its left is west."""
    seen = scan([1.0, 2.0, 3.0], Pose(10.0, 20.0, QUARTER), mount=0.5)
    assert seen.origin == pytest.approx((10.0, 20.5))
    assert seen.points == pytest.approx(np.array([[11.0, 20.5], [10.0, 22.5], [7.0, 20.5]]), abs=1e-12)


def test_a_robot_that_heads_30_degrees() -> None:
    seen = scan([2.0], Pose(1.0, 1.0, math.radians(30.0 + 90.0)), mount=1.0)
    assert seen.origin == pytest.approx((0.5, 1.0 + math.sqrt(0.75)))
    assert seen.points[0] == pytest.approx((0.5 + math.sqrt(3.0), 1.0 + math.sqrt(0.75) + 1.0)), "a beam at 30 degrees"


def test_bearings_are_in_the_frame_of_the_map() -> None:
    assert scan([1, 1, 1], Pose(0, 0, 1.0)).bearings == pytest.approx([1.0 - QUARTER, 1.0, 1.0 + QUARTER])


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf, -1.0, 0.0, -0.0, 8.0, 9.0, 1e30])
def test_a_range_that_is_no_distance_to_anything_is_no_hit(nothing: float) -> None:
    """A beam that met nothing has seen far; one that has measured nothing has not."""
    seen = scan([1.0, nothing, 3.0])
    assert seen.hits.tolist() == [True, False, True]
    assert seen.ranges[1] == math.inf if nothing >= 8.0 else math.isnan(seen.ranges[1])
    assert np.isfinite(seen.points).all(axis=1).tolist() == [True, False, True]


def test_a_range_just_below_the_longest_is_a_hit() -> None:
    assert scan([7.99]).hits.all()


def test_the_longest_range_of_a_message_is_no_hit_although_it_went_through_float32() -> None:
    for longest in (8.0, 5.6, 8.3, 10.1, 80.7, 0.3):
        laser = Laser(angle_min=0.0, angle_step=0.1, range_max=longest, data=np.array([longest], "<f4").tobytes())
        assert not scan_of(lms200(0.0, 0.3).depict(laser), Pose(0, 0, 0)).hits.any(), longest


def test_no_ranges_at_all_are_a_scan_without_points() -> None:
    empty = scan([])
    assert empty.points.shape == (0, 2)
    assert empty.hits.shape == empty.bearings.shape == (0,)


@pytest.mark.parametrize("wrong", [3.0, [[1.0, 2.0]], [[1.0], [2.0]], np.zeros((2, 2)), np.zeros((0, 3))])
def test_what_is_no_list_is_refused(wrong: object) -> None:
    with pytest.raises(ValueError, match="expected a list of ranges"):
        scan(wrong)


@pytest.mark.parametrize("wrong", [[1.0, [2.0, 3.0]], ["near", "far"]])
def test_what_are_no_numbers_is_refused(wrong: object) -> None:
    with pytest.raises((ValueError, TypeError)):
        scan(wrong)


def test_the_ranges_that_were_handed_in_stay_as_they_are() -> None:
    ranges = np.array([1.0, 8.0, math.nan])
    scan(ranges)
    assert ranges[1] == 8.0
    assert math.isnan(ranges[2])


def test_a_message_of_a_laser_is_put_on_the_map() -> None:
    data = np.array([1.0, 8.0, 2.5], dtype="<f4").tobytes()
    laser = Laser(angle_min=-QUARTER, angle_step=QUARTER, range_max=8.0, data=data)
    seen = scan_of(lms200(0.2, 0.3).depict(laser), Pose(1.0, 2.0, math.pi))
    assert seen.origin == pytest.approx((0.8, 2.0))
    assert seen.hits.tolist() == [True, False, True]
    assert seen.points[0] == pytest.approx((0.8, 3.0))
    assert seen.points[2] == pytest.approx((0.8, -0.5))


def test_beams_of_a_range_finder_that_looks_back_from_the_left_are_put_on_the_map() -> None:
    rays = Rays(Pose(-0.2, 0.1, math.pi), first=0.0, step=QUARTER, ranges=[1.0, 3.0], range_max=8.0)
    seen = scan_of(rays, Pose(1.0, 2.0, QUARTER))
    assert seen.origin == pytest.approx((0.9, 1.8))
    assert seen.points == pytest.approx(np.array([[0.9, 0.8], [3.9, 1.8]]))


places = st.builds(Pose, st.floats(-50, 50), st.floats(-50, 50), st.floats(-10, 10))


@given(places, st.floats(-1, 1), st.lists(st.floats(0.01, 7.9), min_size=1, max_size=20))
def test_every_point_is_as_far_from_the_laser_as_its_range_says(pose: Pose, mount: float, ranges: list[float]) -> None:
    seen = make_scan(ranges, pose, mount=mount, angle_min=-1.0, angle_step=0.1, range_max=8.0)
    assert math.dist(seen.origin, (pose.x, pose.y)) == pytest.approx(abs(mount), abs=1e-9)
    assert np.hypot(*(seen.points - seen.origin).T) == pytest.approx(np.array(ranges))


@given(places, st.floats(-2, 2), st.floats(-3, 3), st.floats(-2, 2))
def test_an_even_motion_is_what_many_small_steps_lead_to(pose: Pose, v: float, w: float, dt: float) -> None:
    steps = 2000
    turns = pose.theta + w * dt * (np.arange(steps) + 0.5) / steps
    there = along_arc(pose, Twist(v, w), dt)
    assert there.x == pytest.approx(pose.x + v * dt / steps * np.cos(turns).sum(), abs=1e-4)
    assert there.y == pytest.approx(pose.y + v * dt / steps * np.sin(turns).sum(), abs=1e-4)
    assert there.theta == pytest.approx(pose.theta + w * dt)


@given(places, st.floats(-2, 2), st.floats(-3, 3), st.floats(0, 2))
def test_who_goes_back_the_way_that_it_came_is_where_it_was(pose: Pose, v: float, w: float, dt: float) -> None:
    back = along_arc(along_arc(pose, Twist(v, w), dt), Twist(v, w), -dt)
    assert (back.x, back.y, back.theta) == pytest.approx((pose.x, pose.y, pose.theta), abs=1e-9)
