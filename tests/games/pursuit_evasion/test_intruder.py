"""An intruder crosses the area straight on, at constant speed."""

import math

import numpy as np
import pytest

from tests.games.pursuit_evasion.making import book, field, out
from vrg.agents.strategy import View
from vrg.bus.messages import Stage
from vrg.coordinator.match import Match
from vrg.games.pursuit_evasion.intruder import Intruder
from vrg.games.pursuit_evasion.state import State
from vrg.geometry import along_arc
from vrg.hal.models import robot_model
from vrg.hal.readings import Readings
from vrg.types import STILL, Pose, Twist

ROBOT = robot_model("ATRV-Jr")


def view(state: str, pose: Pose, time: float = 0.0) -> View:
    match = Match(book())
    match.stage = Stage.PLAY_ROUND
    game: State = book().initial().with_state(["i0"], state if state != "disqualified" else "crossing")
    match.game = out(game, "i0") if state == "disqualified" else game
    referee = match.state(field(book()), estop=False)
    me = referee.player("i0")
    assert me is not None
    readings = Readings(stamp=time, age=0.0, armed=True, estop=False)
    return View(time=time, me=me, readings=readings, referee=referee, velocities={}, robot=ROBOT, pose=pose)


def act(player: Intruder, state: str, pose: Pose) -> Twist:
    twist = player.act(view(state, pose))
    assert isinstance(twist, Twist)
    return twist


def driven(player: Intruder, pose: Pose, ticks: int, rng: np.random.Generator | None = None) -> list[Pose]:
    """The way of an intruder in play. With a random source, its own pose is wrong by 2 cm and half a degree."""
    way = [pose]
    for _ in range(ticks):
        noise = (0.0, 0.0, 0.0) if rng is None else (rng.standard_normal(3) * (0.02, 0.02, 0.009)).tolist()
        measured = Pose(pose.x + noise[0], pose.y + noise[1], pose.theta + noise[2])
        pose = along_arc(pose, act(player, "crossing", measured), 0.1)
        way.append(pose)
    return way


def left_of(course: Pose, pose: Pose) -> float:
    return (pose.y - course.y) * math.cos(course.theta) - (pose.x - course.x) * math.sin(course.theta)


def test_it_waits_until_it_may_go() -> None:
    player = Intruder("i0", ROBOT)
    for _ in range(5):
        assert act(player, "waiting", Pose(-2.0, 5.0, 0.3)) == STILL
    assert act(player, "crossing", Pose(-2.0, 5.0, 0.3)).v == ROBOT.v_max


@pytest.mark.parametrize("heading", [0.0, 1.0, math.pi, -math.pi, -3.0, 7.0])
def test_it_drives_straight_on_at_top_speed_whatever_its_heading(heading: float) -> None:
    start = Pose(-2.0, 5.0, heading)
    way = driven(Intruder("i0", ROBOT), start, 100)
    assert max(abs(left_of(start, pose)) for pose in way) < 1e-6
    assert math.dist((way[0].x, way[0].y), (way[-1].x, way[-1].y)) == pytest.approx(10.0 * ROBOT.v_max)


def test_it_drives_straight_on_also_when_its_own_pose_is_not_exact() -> None:
    start = Pose(-2.0, 5.0, 0.7)
    for seed in range(10):
        way = driven(Intruder("i0", ROBOT), start, 150, np.random.default_rng(seed))
        assert max(abs(left_of(start, pose)) for pose in way) < 0.5
        assert max(abs(math.remainder(pose.theta - 0.7, math.tau)) for pose in way) < 0.15


@pytest.mark.parametrize(("aside", "turn"), [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.6), (0.0, -0.6), (0.8, 0.8), (-0.8, 3.0)])
def test_who_is_pushed_off_its_line_comes_back_to_it(aside: float, turn: float) -> None:
    player, start = Intruder("i0", ROBOT), Pose(0.0, 0.0, 0.0)
    *_, pose = driven(player, start, 20)
    pushed = Pose(pose.x, pose.y + aside, pose.theta + turn)
    *_, end = driven(player, pushed, 200)
    assert left_of(start, end) == pytest.approx(0.0, abs=0.02)
    assert math.remainder(end.theta, math.tau) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("state", ["captured", "escaped", "disqualified"])
def test_it_stops_when_it_is_out_of_play(state: str) -> None:
    player = Intruder("i0", ROBOT)
    driven(player, Pose(0.0, 0.0, 0.0), 5)
    for _ in range(3):
        assert act(player, state, Pose(0.4, 0.0, 0.0)) == STILL


def test_who_is_put_back_to_its_start_crosses_from_there() -> None:
    player = Intruder("i0", ROBOT)
    driven(player, Pose(0.0, 0.0, 0.0), 30)
    act(player, "captured", Pose(3.0, 0.0, 0.0))
    act(player, "waiting", Pose(3.0, 0.0, 0.0))
    act(player, "waiting", Pose(-2.0, 5.0, 1.2))
    way = driven(player, Pose(-2.0, 5.0, 1.2), 50)
    assert max(abs(left_of(way[0], pose)) for pose in way) < 1e-6
