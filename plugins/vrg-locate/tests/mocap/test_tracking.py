"""From rigid bodies to robots: axes, offsets, and what is no measurement."""

import math
from typing import Literal

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from vrg.geometry import compose, inverse, wrap
from vrg.types import Pose
from vrg_locate.mocap.frames import MeasuredBody, MocapFrame
from vrg_locate.mocap.tracking import FROZEN, TIPPED, Fault, Quaternion, Tracking, heading, tilt, with_z_up

Up = Literal["y", "z"]
HERE = Pose(0.0, 0.0, 0.0)
coordinate = st.floats(-50.0, 50.0)
angle = st.floats(-math.pi, math.pi)
poses = st.builds(Pose, coordinate, coordinate, angle)
offsets = st.builds(Pose, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), angle)
part = st.floats(-1.0, 1.0)
ups: st.SearchStrategy[Up] = st.sampled_from(("y", "z"))


@st.composite
def rotations(draw: st.DrawFn) -> Quaternion:
    """A quaternion w, x, y, z of length 1."""
    w, x, y, z = (draw(part) for _ in range(4))
    length = math.hypot(w, x, y, z)
    assume(length > 0.1)
    return w / length, x / length, y / length, z / length


def turned(rotation: Quaternion) -> Rotation:
    w, x, y, z = rotation
    return Rotation.from_quat([x, y, z, w])


def body(pose: Pose, up: Up = "z", name: str = "Rob", height: float = 0.2) -> MeasuredBody:
    """A rigid body that stands upright at a pose in the system's own frame, with the axis up that it has."""
    cos, sin = math.cos(pose.theta / 2), math.sin(pose.theta / 2)
    if up == "z":
        return MeasuredBody(name, (pose.x, pose.y, height), (cos, 0.0, 0.0, sin))
    # y up: z points to where -y did.
    return MeasuredBody(name, (pose.x, height, -pose.y), (cos, 0.0, sin, 0.0))


def found(tracking: Tracking, *bodies: MeasuredBody, time: float = 0.0) -> list[Pose | Fault]:
    return [outcome.found for outcome in tracking.take(MocapFrame(time, list(bodies)))]


def plain(up: Up = "z") -> Tracking:
    return Tracking({"Rob": "ann"}, {}, up, HERE)


@given(robot=poses, offset=offsets, origin=poses, up=ups)
def test_a_robot_is_where_its_body_is_less_the_offset(robot: Pose, offset: Pose, origin: Pose, up: Up) -> None:
    tracking = Tracking({"Rob": "ann"}, {"ann": offset}, up, origin)
    captured = compose(inverse(origin), compose(robot, offset))
    (outcome,) = tracking.take(MocapFrame(0.0, [body(captured, up)]))
    assert (outcome.body, outcome.robot) == ("Rob", "ann")
    assert isinstance(outcome.found, Pose)
    assert math.hypot(outcome.found.x - robot.x, outcome.found.y - robot.y) < 1e-9
    assert abs(wrap(outcome.found.theta - robot.theta)) < 1e-9


@given(rotation=rotations())
def test_heading_and_tilt_are_those_of_the_turned_axes(rotation: Quaternion) -> None:
    ahead, top = turned(rotation).apply([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert math.cos(tilt(rotation)) == pytest.approx(top[2], abs=1e-9)
    assume(math.hypot(ahead[0], ahead[1]) > 1e-3)
    assert abs(wrap(heading(rotation) - math.atan2(ahead[1], ahead[0]))) < 1e-6
    w, x, y, z = rotation
    assert heading((-w, -x, -y, -z)) == heading(rotation)


@given(rotation=rotations(), place=st.tuples(part, part, part))
def test_axes_with_y_up_are_turned_about_x(rotation: Quaternion, place: tuple[float, float, float]) -> None:
    about_x = Rotation.from_euler("x", 90, degrees=True)
    position, now = with_z_up(place, rotation, "y")
    assert position == pytest.approx(about_x.apply(place), abs=1e-9)
    expected = about_x * turned(rotation) * about_x.inv()
    assert np.allclose(turned(now).as_matrix(), expected.as_matrix(), atol=1e-9)
    assert with_z_up(place, rotation, "z") == (place, rotation)


@given(theta=angle, lean=st.floats(0.0, math.pi), about=angle)
def test_what_has_tipped_over_is_no_fix(theta: float, lean: float, about: float) -> None:
    assume(abs(lean - TIPPED) > 1e-6)
    leaning = Rotation.from_rotvec([lean * math.cos(about), lean * math.sin(about), 0.0])
    x, y, z, w = map(float, (leaning * Rotation.from_euler("z", theta)).as_quat())
    (one,) = found(plain(), MeasuredBody("Rob", (0.0, 0.0, 0.2), (w, x, y, z)))
    assert (one is Fault.TIPPED) == (lean > TIPPED)


def test_the_wrong_axis_up_makes_robots_that_turn_seem_to_tip_over() -> None:
    assert found(plain("z"), body(Pose(1.0, 2.0, 1.0), "y")) == [Fault.TIPPED]
    assert found(plain("y"), body(Pose(1.0, 2.0, 1.0), "z")) == [Fault.TIPPED]


@given(
    position=st.tuples(*[st.floats(-1e6, 1e6) | st.sampled_from((math.nan, math.inf))] * 3),
    rotation=st.tuples(*[st.floats(-2.0, 2.0) | st.sampled_from((0.0, math.nan, -math.inf))] * 4),
    up=ups,
)
def test_whatever_a_system_sends_a_pose_is_finite(
    position: tuple[float, float, float], rotation: Quaternion, up: Up
) -> None:
    (one,) = found(plain(up), MeasuredBody("Rob", position, rotation))
    if isinstance(one, Pose):
        assert all(math.isfinite(value) for value in (*position, *rotation))
        assert abs(one.x) <= 1e4
        assert abs(one.y) <= 1e4
        assert abs(one.theta) <= math.pi
        assert math.hypot(*rotation) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    "lost",
    [
        MeasuredBody("Rob", (math.nan, math.nan, math.nan), (1.0, 0.0, 0.0, 0.0)),
        MeasuredBody("Rob", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        MeasuredBody("Rob", (9_999_999.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
    ],
)
def test_what_has_not_been_measured_is_no_fix(lost: MeasuredBody) -> None:
    assert found(plain(), lost) == [Fault.UNTRACKED]


def test_a_body_that_does_not_change_at_all_is_no_measurement() -> None:
    tracking, one, other = plain(), body(Pose(1.0, 2.0, 0.3)), body(Pose(1.0, 2.0001, 0.3))
    assert isinstance(found(tracking, one, time=0.0)[0], Pose)
    assert found(tracking, one, time=0.02) == [Fault.REPEATED]
    assert found(tracking, time=0.04) == []
    assert found(tracking, one, time=FROZEN) == [Fault.FROZEN]
    assert isinstance(found(tracking, other, time=FROZEN + 0.02)[0], Pose)
    assert found(tracking, other, time=FROZEN + 0.04) == [Fault.REPEATED]
    assert isinstance(found(tracking, one, time=FROZEN + 0.06)[0], Pose)


def test_bodies_of_nobody_are_told_and_the_others_are_found() -> None:
    outcomes = plain().take(MocapFrame(0.0, [body(HERE, name="chair"), body(HERE), body(HERE, name="")]))
    assert [(one.body, one.robot) for one in outcomes] == [("chair", None), ("Rob", "ann"), ("", None)]
    assert [one.found for one in outcomes] == [Fault.UNKNOWN, HERE, Fault.UNKNOWN]
