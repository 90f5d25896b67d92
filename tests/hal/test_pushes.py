"""What becomes of a robot that another one pushes, in every engine."""

import math
from functools import cache

import pytest

from tests.hal.engine_bench import ENGINE_NAMES, body_of, deepest_overlap, forward, run
from tests.hal.pushes import PUSHES, SECONDS, STATES, Push
from vrg.hal.models import robot_model
from vrg.hal.sim.engines import ENGINES
from vrg.hal.sim.engines.engine import DRIVE, Start
from vrg.hal.sim.map import load_map
from vrg.types import Pose

HOLDS = 0.25
"""How far off its place or its way a robot may be pushed that holds, m. The engines agree within this: with rigid
bodies the pushed robot slides until the blow is spent, in the planar engine a blow moves nobody."""
OBLIQUELY = 0.4
"""The same for one that drives and is hit obliquely, m: it is turned a little and drives on that way."""
P2AT, ATRV_JR = robot_model("P2AT"), robot_model("ATRV-Jr")
SIDES = ("front", "oblique", *(pytest.param(side, marks=pytest.mark.thorough) for side in ("side", "rear")))


def is_heavier(push: Push) -> bool:
    return robot_model(push.pusher).mass > robot_model(push.pushed).mass


@cache
def off_way(engine: str, push: Push) -> float:
    """How far a push brings the pushed robot off its way, m."""
    return push.off_way(engine)


def test_there_are_40_of_every_kind() -> None:
    assert len(PUSHES) == 40
    assert {push.state for push in PUSHES} == set(STATES)
    assert sum(is_heavier(push) for push in PUSHES) == 8


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("side", SIDES)
def test_an_equal_or_lighter_one_does_not_push_it_away(engine: str, side: str) -> None:
    for push in PUSHES:
        if push.side == side and not is_heavier(push):
            far = OBLIQUELY if (push.state, side) == ("driving", "oblique") else HOLDS
            assert off_way(engine, push) < far, push


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("side", SIDES)
def test_a_heavier_one_pushes_it_along_at_its_own_speed(engine: str, side: str) -> None:
    for push in PUSHES:
        if push.side == side and is_heavier(push):
            assert off_way(engine, push) == pytest.approx(4.0, abs=0.15), push


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
@pytest.mark.parametrize("side", [side for side in SIDES if side != "oblique"])
@pytest.mark.parametrize("state", ["braked", "at rest"])
@pytest.mark.parametrize("pair", [("P2AT", "P2AT"), ("ATRV-Jr", "ATRV-Jr"), ("P2AT", "ATRV-Jr")])
def test_a_blow_is_spent_by_the_friction_that_the_motors_do_not_overcome(
    engine: str, pair: tuple[str, str], state: str, side: str
) -> None:
    """Both go on together after the blow; the friction of the one, less the drive of the other, brakes both."""
    pusher, pushed = (robot_model(name) for name in pair)
    speed = pusher.mass * pusher.v_max / (pusher.mass + pushed.mass)
    force = pushed.brake * pushed.mass - DRIVE * pusher.brake * pusher.mass
    way = speed**2 * (pusher.mass + pushed.mass) / 2 / force
    assert off_way(engine, Push(*pair, side, state)) == pytest.approx(way, abs=0.01)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_it_does_not_creep(engine: str) -> None:
    push = Push("P2AT", "P2AT", "rear", "braked")
    assert push.off_way(engine, 4 * SECONDS) - push.off_way(engine) < 0.001


@pytest.mark.parametrize("engine_name", ENGINE_NAMES)
def test_a_heavier_one_presses_it_against_a_wall_and_may_leave(engine_name: str) -> None:
    light, heavy = Start("light", P2AT, Pose(-3.5, -1.0, 0.3)), Start("heavy", ATRV_JR, Pose(-2.0, -1.0, math.pi))
    engine = ENGINES.get(engine_name)(load_map("marhes_lab"), [light, heavy])
    forward(engine, "heavy", 1.0)
    for _ in range(150):
        run(engine, 0.02)
        assert deepest_overlap(engine) < 0.02
    assert -4.4 < body_of(engine, "light").pose.x < -3.8
    assert abs(body_of(engine, "heavy").twist.v) < 0.1
    forward(engine, "heavy", -0.5)
    run(engine, 3.0)
    assert body_of(engine, "heavy").pose.x > -2.8
    forward(engine, "light", 0.5)
    run(engine, 1.0)
    assert body_of(engine, "light").twist.v == pytest.approx(0.5, rel=0.05)
    engine.close()
