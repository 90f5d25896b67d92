"""What a match shows of a robot, from what was recorded of it."""

from itertools import pairwise

import pytest

from fitting.test_response import SLOW, commanded, driven
from vrg.geometry import along_arc, compose
from vrg.hal.models import robot_model
from vrg.localisation.motion import corrected
from vrg.types import STILL, Pose, Twist
from vrg_locate.fitting.likeness import GROUPS, SPAN
from vrg_locate.fitting.report import findings
from vrg_locate.fitting.response import AxisRun, followed
from vrg_locate.fitting.runs import HELD, axis_runs, held, unbroken

MODEL = robot_model("P2AT")
LEARNED = {"way": (0.03, 0.001), "turn": (0.0, 0.002), "bend": (0.0, 0.001)}


def drive(
    seconds: float,
) -> tuple[list[tuple[float, Twist]], list[tuple[float, Pose, Twist]], list[tuple[float, Pose]]]:
    """Commands, odometry and poses of a robot that follows as SLOW does, and whose ways are 3 % longer."""
    train, radius = MODEL.drivetrain, MODEL.drivetrain.wheel_radius
    turns = [speed for _, speed in commanded(seconds, 1)]
    commands = [(time, Twist(v, 0.8 * w)) for (time, v), w in zip(commanded(seconds), turns, strict=True)]
    times = [0.1 * n + 0.03 for n in range(int(10 * seconds))]
    rims = [
        followed(SLOW, AxisRun([(t, train.speeds(twist)[axis] * radius) for t, twist in commands], times, ()))
        for axis in (0, 1)
    ]
    pose = true = Pose(1.0, 2.0, 0.5)
    motions, poses = [(times[0], pose, STILL)], [(times[0], true)]
    for (before, after), left, right in zip(pairwise(times), *rims, strict=True):
        way = train.twist((left / radius, right / radius))
        twist = Twist(way.v / (after - before), way.w / (after - before))
        pose = along_arc(pose, way, 1.0)
        true = compose(true, corrected(along_arc(Pose(0.0, 0.0, 0.0), way, 1.0), 0.03, 0.0, 0.0))
        motions.append((after, pose, twist))
        poses.append((after, true))
    return commands, motions, poses


def test_a_robot_is_found_to_be_as_it_is_and_unlike_its_simulation() -> None:
    found = findings(MODEL, *drive(90.0), LEARNED)
    truth = {"delay": 0.09, "acceleration": 0.7, "braking": 1.1, "friction": 0.2, "top": 0.6, "way": 0.03}
    for name, true in truth.items():
        assert found.numbers[name][0] == pytest.approx(true, abs=max(0.01, 2 * found.numbers[name][1])), name
    like = found.likeness
    assert like is not None
    assert 90.0 / SPAN * 0.5 < like.spans < 90.0 / SPAN
    assert like.after < 0.2 * like.before, "that is what makes them differ"
    assert all(like.without[name] > 1.05 * like.after for name in GROUPS)
    assert like.without["turn"] == pytest.approx(like.after, rel=0.01), "its turns are as they should be"
    motion = found.motion(MODEL)
    assert motion["a_max"] == pytest.approx(0.7 * 1.03, rel=0.05), "true metres"
    assert motion["slowing"] == pytest.approx(1.1 * 1.03, rel=0.05)
    assert motion["v_max"] == pytest.approx(0.6 * 1.03, rel=0.02)
    assert motion["delay"] == pytest.approx(0.09, abs=0.01)


def test_without_a_recording_the_errors_of_the_odometry_are_still_known() -> None:
    found = findings(MODEL, [], [], [], LEARNED)
    assert isinstance(found.fitted, str)
    assert found.numbers == {name: (mean, pytest.approx(1.96 * sigma)) for name, (mean, sigma) in LEARNED.items()}
    assert found.motion(MODEL) == {}
    assert found.likeness is None


def test_a_command_that_is_not_repeated_ends() -> None:
    """As when play is halted: then the device stops the robot."""
    twist = Twist(0.5, 0.0)
    assert held([(0.0, twist), (0.1, twist), (5.0, twist)]) == [
        (0.0, twist), (0.1, twist), (0.1 + HELD, STILL), (5.0, twist), (5.0 + HELD, STILL),
    ]  # fmt: skip


def test_runs_end_where_odometry_begins_anew_or_is_not_heard() -> None:
    commands, motions, _ = drive(9.0)
    jumped = [(t, pose if t < 3.0 else Pose(pose.x - 5.0, pose.y, pose.theta), twist) for t, pose, twist in motions]
    silent = [motion for motion in jumped if not 6.0 < motion[0] < 7.0]
    parts = unbroken(silent, 2.0 * MODEL.v_max)
    assert [round(part[0][0]) for part in parts] == [0, 3, 7]
    runs = axis_runs(MODEL, commands, silent)
    assert len(runs) == 2 * len(parts)
    assert driven(SLOW, 1.0).commands  # the same form
    whole = axis_runs(MODEL, commands, motions)[0]
    assert sum(run.ways[-1] for run in runs[::2]) < whole.ways[-1] + 1e-9
