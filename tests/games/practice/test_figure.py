"""The figure that a robot drives: it stays in its room, whatever happens, and gives up where it cannot get back."""

import math

import pytest

from vrg.agents.strategy import View
from vrg.bus.messages import PlayerStatus, RefereeState, Stage, Zone
from vrg.games.practice.figure import FIGURE, Figure
from vrg.geometry import along_arc
from vrg.hal.models import robot_model
from vrg.hal.models.settings import with_motion
from vrg.hal.readings import Readings
from vrg.regions import Rectangle
from vrg.types import Pose, Twist

MODEL = robot_model("P2AT")


def look(time: float, pose: Pose, half: float) -> View:
    me = PlayerStatus(
        name="ann",
        team="team",
        role="player",
        state="active",
        may_move=True,
        radius=0.35,
        pose=pose,
        mark=None,
        lease=None,
    )
    zone = Zone(name="field", kind="field", region=Rectangle(-half, -half, half, half))
    state = RefereeState(
        game="practice", stage=Stage.PLAY_ROUND, halted=None, way_out=None, waiting=(), clock=time, total=time, round=1,
        rounds=1, score={}, players=(me,), zones=(zone,), estop=False, winner=None,
    )  # fmt: skip
    readings = Readings(stamp=time, age=0.0, armed=True, estop=False, fault=None, latched=False, samples=[])
    return View(
        time=time, me=me, readings=readings, referee=state, velocities={}, robot=MODEL, pose=pose, priority=None,
        heard=(), obstacles=(), uncertainty=None,
    )  # fmt: skip


def driven(speed: float, half: float, *, turned: float = 1.0, carried: float = 0.0, seconds: float = 120.0):
    """The poses and modes of a robot that drives the figure with a bounded acceleration.

    Args:
        turned: the factor to its ways: -1 for wrong directions. carried: by how far it is put aside after 30 s, m.
    """
    robot = with_motion(MODEL, {"v_max": speed})
    figure, pose, twist = Figure("ann", robot), Pose(0.05, 0.0, 0.3), Twist(0.0, 0.0)
    found = []
    for n in range(round(seconds / 0.1)):
        wanted = figure.act(look(0.1 * n, pose, half))
        change = max(-0.1, min(0.1, wanted.v - twist.v))
        twist = Twist(twist.v + change, wanted.w)
        pose = along_arc(pose, Twist(turned * twist.v, twist.w), 0.1)
        if carried and n == 300:
            pose = Pose(pose.x + carried, pose.y, pose.theta)
        found.append((pose, figure.mode))
    return found


@pytest.mark.parametrize(("speed", "half"), [(0.3, 0.6), (0.5, 1.0), (0.7, 1.5), (2.0, 1.0)])
def test_it_stays_in_its_room_and_drives_all_parts(speed: float, half: float) -> None:
    found = driven(speed, half)
    assert max(max(abs(pose.x), abs(pose.y)) for pose, _ in found) < half + 0.02
    assert len({mode for _, mode in found}) >= len(FIGURE)


def test_a_robot_that_was_carried_drives_back() -> None:
    found = driven(0.5, 1.0, carried=1.5)
    assert "Returning" in {mode for _, mode in found[300:]}
    assert all(math.hypot(pose.x, pose.y) < 1.5 for pose, _ in found[450:])


def test_a_robot_whose_wheels_turn_the_wrong_way_gives_up() -> None:
    found = driven(0.5, 1.0, turned=-1.0)
    assert found[-1][1] == "Gives up"
    assert max(max(abs(pose.x), abs(pose.y)) for pose, _ in found) < 2.0
