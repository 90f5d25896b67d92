"""The estimator of a robot's pose: late fixes, wrong ones, robots that are carried, and how well it knows itself."""

import math
from itertools import pairwise
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.localisation.driving import Drive
from vrg.bus.messages import LOST, Fix
from vrg.geometry import along_arc, wrap
from vrg.hal.models import robot_model
from vrg.localisation.estimator import AGREEING, WINDOW, Estimate, Estimator, FixFate
from vrg.localisation.motion import motion_noise
from vrg.types import Pose, Twist

NOISE = motion_noise(robot_model("P2AT"))
ORIGIN = Pose(0.0, 0.0, 0.0)
STEP = 0.1


def estimator(start: Pose = ORIGIN) -> Estimator:
    return Estimator(start, NOISE, position=0.05, heading=0.05)


def known(found: Estimator) -> Estimate:
    """What an estimator knows by now."""
    assert found.estimate is not None
    return found.estimate


def fix(time: float, pose: Pose) -> tuple[float, Fix]:
    return time, Fix("ann", pose, 0.01, 0.02)


def driven(twists: list[tuple[float, float]]) -> list[tuple[float, Pose]]:
    """The times and poses of a robot that drives with each twist for STEP."""
    poses = [ORIGIN]
    for v, w in twists:
        poses.append(along_arc(poses[-1], Twist(v, w), STEP))
    return [(STEP * number, pose) for number, pose in enumerate(poses)]


TWISTS = st.lists(st.tuples(st.floats(-0.7, 0.7), st.floats(-1.5, 1.5)), min_size=3, max_size=9)


@given(TWISTS, st.data())
def test_late_fixes_count_as_if_they_had_come_in_time(twists: list[tuple[float, float]], data: st.DataObject) -> None:
    """Whatever the order in which odometry and fixes come, the estimate is the same."""
    way = driven(twists)
    off = st.tuples(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
    fixes = []
    for (one, a), (_, b) in pairwise(way):
        share = data.draw(st.floats(0.05, 0.95))
        dx, dy, turn = data.draw(off)
        x, y = a.x + share * (b.x - a.x) + dx, a.y + share * (b.y - a.y) + dy
        fixes.append(fix(one + share * STEP, Pose(x, y, wrap(a.theta + share * (b.theta - a.theta) + turn))))
    in_time, late = estimator(), estimator()
    coming = sorted(fixes, key=itemgetter(0))
    for time, pose in way:
        in_time.move(time, pose)
        while coming and coming[0][0] <= time:
            assert in_time.correct(*coming.pop(0)) is FixFate.USED
    for time, pose in way:
        late.move(time, pose)
    for one in data.draw(st.permutations(fixes)):
        assert late.correct(*one) is FixFate.USED
    a, b = known(in_time), known(late)
    assert (a.pose.x, a.pose.y, a.pose.theta) == pytest.approx((b.pose.x, b.pose.y, b.pose.theta), abs=1e-9)
    assert a.covariance == pytest.approx(b.covariance, abs=1e-12)
    assert a.age == b.age
    assert np.linalg.eigvalsh(a.covariance).min() > 0.0


def test_a_fix_of_a_time_that_odometry_has_not_reached_waits_for_it() -> None:
    found = estimator()
    assert found.correct(*fix(0.05, Pose(0.03, 0.0, 0.0))) is None
    assert found.move(0.0, ORIGIN) == []
    assert found.correct(*fix(0.15, Pose(0.03, 0.0, 0.0))) is None
    assert found.correct(*fix(0.25, Pose(0.03, 0.0, 0.0))) is FixFate.EARLY
    assert found.move(0.2, ORIGIN) == [FixFate.USED, FixFate.USED]
    assert known(found).age == pytest.approx(0.05)
    assert 0.02 < known(found).pose.x < 0.03


def test_fixes_that_come_too_late_are_refused() -> None:
    found = estimator()
    for number in range(30):
        found.move(number * STEP, ORIGIN)
    assert found.correct(*fix(2.9 - WINDOW - STEP, ORIGIN)) is FixFate.LATE
    assert found.correct(*fix(2.9 - WINDOW + 0.05, ORIGIN)) is FixFate.USED
    assert known(found).age == pytest.approx(WINDOW - 0.05)
    assert known(found).age > LOST


def test_a_fix_without_a_heading_moves_the_position() -> None:
    found = estimator()
    found.move(0.0, ORIGIN)
    found.move(0.1, ORIGIN)
    assert found.correct(0.1, Fix("ann", Pose(0.05, -0.05, 3.0), 0.001)) is FixFate.USED
    assert found.correct(0.1, Fix("ann", Pose(5.0, 0.0, 0.0), 0.01)) is FixFate.FAR
    pose = known(found).pose
    assert (pose.x, pose.y, pose.theta) == pytest.approx((0.05, -0.05, 0.0), abs=1e-3)


def test_a_robot_seen_under_another_name_for_a_moment_stays_where_it_is() -> None:
    found = estimator()
    verdicts = []
    for number in range(20):
        time, x = number * STEP, 0.05 * number
        found.move(time, Pose(x, 0.0, 0.0))
        elsewhere = number in (8, 9, 14)
        verdicts.append(found.correct(*fix(time, Pose(3.0 if elsewhere else x, 2.0 if elsewhere else 0.0, 0.0))))
    assert [number for number, verdict in enumerate(verdicts) if verdict is FixFate.FAR] == [8, 9, 14]
    assert known(found).pose.x == pytest.approx(0.95, abs=0.02)


def test_a_robot_that_is_carried_is_lost_until_it_was_seen_to_stay_for_a_while() -> None:
    found = estimator()
    there, lost = Pose(2.0, 1.0, 1.5), []
    for number in range(40):
        time = number * STEP
        found.move(time, ORIGIN)  # its wheels do not turn
        on_the_way = Pose(0.2 * (number - 10), 0.1 * (number - 10), 0.0)
        found.correct(*fix(time, ORIGIN if number < 10 else there if number >= 20 else on_the_way))
        if known(found).age > LOST:
            lost.append(number)
    # Last seen where it was after 1.0 s; from 2 s on, the place must be seen five times, and LOST longer.
    assert lost == list(range(16, 20 + AGREEING - 1 + round(LOST / STEP)))
    pose = known(found).pose
    assert (pose.x, pose.y, pose.theta) == pytest.approx((2.0, 1.0, 1.5), abs=0.02)


def test_a_robot_that_is_pushed_a_little_is_found_before_it_is_lost() -> None:
    found, verdicts = estimator(), []
    for number in range(60):
        time = number / 15.0
        found.move(time, ORIGIN)
        verdicts.append(found.correct(*fix(time, Pose(0.0, 0.2 if number >= 30 else 0.0, 0.0))))
        assert known(found).age <= LOST
    assert verdicts.index(FixFate.MOVED) == 30 + AGREEING - 1
    assert known(found).pose.y == pytest.approx(0.2, abs=0.01)


def test_odometry_that_begins_anew_moves_nothing() -> None:
    """The player was restarted: its robot's odometry is at zero again, and may have missed a little of the way."""
    found = estimator()
    for number in range(20):
        time, x = number * STEP, 0.05 * number
        odometry = Pose(x if number < 10 else x - 0.5, 0.0, 0.0)
        found.move(time, odometry)
        assert found.correct(*fix(time - 0.05, Pose(x - 0.025, 0.0, 0.0))) in (FixFate.USED, FixFate.LATE)
        assert known(found).pose.x == pytest.approx(x, abs=0.06)
    assert known(found).pose.x == pytest.approx(0.95, abs=0.02)


def test_what_the_odometry_is_off_by_is_learned() -> None:
    """The wheels of this robot are 2 % larger than it knows, and it drives a curve where it is to drive straight on."""
    found, odometry, truth = estimator(), ORIGIN, ORIGIN
    rng = np.random.default_rng(1)
    for number in range(1500):
        time, v, w = number * STEP, 0.5, (0.5, -0.5, 0.0)[number // 50 % 3]
        found.move(time, odometry)
        noise = rng.normal(scale=(0.01, 0.01, 0.02))
        found.correct(*fix(time, Pose(truth.x + noise[0], truth.y + noise[1], wrap(truth.theta + noise[2]))))
        odometry = along_arc(odometry, Twist(v, w), STEP)
        truth = along_arc(truth, Twist(1.02 * v, 0.99 * w + 0.04 * v), STEP)
    errors, covariance = found.errors
    deviations = np.sqrt(np.diag(covariance))
    assert np.abs(errors - (0.02, -0.01, 0.04)).max() < 0.004
    assert (np.abs(errors - (0.02, -0.01, 0.04)) < 4 * deviations).all()
    assert (deviations < 0.1 * np.array([NOISE.longer, NOISE.wider, NOISE.bend])).any()


@pytest.mark.parametrize(
    ("camera", "far"), [({"rate": 15.0, "loss": 0.2, "delay": 0.15}, 0.02), ({"rate": 5.0, "swaps": 0.1}, 0.03)]
)
def test_driven_robots_are_located_and_the_covariance_is_true(camera: dict[str, float], far: float) -> None:
    drive = Drive(1, camera, 20.0, 6)
    distance, turned = np.hypot(drive.errors[..., 0], drive.errors[..., 1]), np.abs(drive.errors[..., 2])
    assert np.quantile(distance, 0.95) < far
    assert np.quantile(turned, 0.95) < math.radians(1.5)
    # Of six robots for 18 s, with few independent instants: 3 is true, and a filter that is too sure has more.
    assert 1.5 < drive.nees.mean() < 4.5


def test_without_fixes_the_error_grows_and_the_covariance_with_it() -> None:
    drive = Drive(2, None, 30.0, 6)
    found = [one.estimate for one in drive.estimators.values()]
    assert all(one is not None and one.age == math.inf for one in found)
    assert 0.05 < np.hypot(drive.errors[:, -1, 0], drive.errors[:, -1, 1]).mean() < 2.0
    assert 0.5 < drive.nees[:, -1].mean() < 12.0


@pytest.mark.parametrize("rate", [10, 15, 50, 100])
@pytest.mark.parametrize(("ahead", "angle"), [(0.5, math.pi), (-0.5, math.pi), (0.5, math.pi / 2), (0.2, -2.0)])
def test_a_tag_that_is_turned_is_noticed_by_the_way_that_the_robot_drives(
    ahead: float, angle: float, rate: int
) -> None:
    """It is located no more, as it would drive another way than its player wants."""
    found, verdicts = estimator(), []
    for number in range(4 * rate):
        time = number / rate
        truth = along_arc(ORIGIN, Twist(ahead, 0.2), max(0.0, time - 1.0))
        found.move(time, truth)
        tag = Pose(truth.x, truth.y, wrap(truth.theta + angle))
        verdicts.append(found.correct(*fix(time, tag)))
    assert verdicts[AGREEING - 1] is FixFate.MOVED, "a robot that stands may be so"
    assert FixFate.TURNED not in verdicts[:rate]
    assert set(verdicts[2 * rate :]) == {FixFate.TURNED}
    assert found.turned is not None
    assert wrap(found.turned - angle) == pytest.approx(0.0, abs=0.1)
    assert known(found).age > LOST


def test_a_robot_that_is_pulled_back_while_its_wheels_spin_is_elsewhere_and_not_turned() -> None:
    found = estimator()
    for number in range(40):
        time = number / 15.0
        found.move(time, Pose(0.03 * number, 0.0, 0.0))
        found.correct(*fix(time, Pose(0.03 * number if number < 10 else 0.3 - 0.05 * (number - 10), 0.0, 0.0)))
    assert found.turned is None
    assert known(found).age > LOST


def test_an_error_that_all_fixes_share_does_not_average_out() -> None:
    found = estimator()
    for number in range(60):
        time = number / 15.0
        found.move(time, ORIGIN)
        found.correct(time, Fix("ann", ORIGIN, 0.005, 0.01, (0.06, 0.03)))
    deviations = np.sqrt(np.diag(known(found).covariance))
    assert deviations == pytest.approx([0.06, 0.06, 0.03], rel=0.02)
    found.correct(time, Fix("ann", ORIGIN, 0.005, 0.01))
    assert np.sqrt(np.diag(known(found).covariance)).max() < 0.005, "and is none where a source has none"
