"""The motion of a batch is that of the planar engine."""

import math

import numpy as np
import pytest

from vrg.hal.models import robot_model
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.engines.planar import PlanarEngine
from vrg.hal.sim.map import Map
from vrg.hal.sim.shapes import Box
from vrg.regions import Circle, Rectangle
from vrg.testing.omni import OMNI
from vrg.types import Pose, Twist
from vrg_learn.batch import motion
from vrg_learn.compiled import compiled

MODELS = [robot_model(name) for name in ("P2AT", "ATRV-Jr", *["P2AT"] * 4)]
PEN = Map(
    "pen",
    Rectangle(-2.0, -1.3, 2.0, 1.3),
    (
        *(Box(0.0, side * 1.5, 0.0, 4.0, 0.4) for side in (-1.0, 1.0)),
        *(Box(side * 2.2, 0.0, math.pi / 2, 3.4, 0.4) for side in (-1.0, 1.0)),
        Box(0.55, -1.2, 0.2, 0.4, 0.3),
    ),
    (Circle(0.55, -0.05, 0.2), Circle(-0.55, -0.05, 0.2)),
)
"""Walls so near around the robots that all soon run into them, and something slanted and round things between them."""
TICK = 0.02
"""The step of physics, s."""


@pytest.mark.parametrize("seed", [4, *(pytest.param(n, marks=pytest.mark.thorough) for n in range(3))])
def test_robots_in_a_crowd_move_as_in_the_planar_engine(seed: int, small: bool) -> None:
    """They push one another and walls, brake and are let go again, to the same places and with the same wheels."""
    rng = np.random.default_rng(seed)
    starts, walls = [], motion.walls_of(PEN)
    both = motion.motions(1, len(MODELS), 2), motion.robots(MODELS, 1)
    motions, robots = both[0][0], both[1][0]
    advance, command, lock = compiled(motion.advance), compiled(motion.command), compiled(motion.lock)
    for n, model in enumerate(MODELS):
        x, y, theta = 1.1 * (n % 3 - 1) + rng.uniform(-0.1, 0.1), 0.5 - 1.1 * (n // 3), rng.uniform(-3.0, 3.0)
        starts.append(Start(f"r{n}", model, Pose(x, y, theta)))
        motions.poses[n] = x, y, theta
    engine = PlanarEngine(PEN, starts)
    touched = 0
    for step in range(40 if small else 150):
        for n, model in enumerate(MODELS):
            if rng.random() < 0.1:
                engine.command(f"r{n}", None)
                lock(motions, n)
            elif step == 0 or rng.random() < 0.1:
                twist = Twist(rng.uniform(-1.0, 1.0), rng.uniform(-2.4, 2.4) * (rng.random() < 0.4))
                engine.command(f"r{n}", model.limited(twist))
                command(motions, robots, n, twist.v, twist.w, model.v_max)
        for _ in range(5):
            angles = engine.angles.copy()
            engine.step(TICK)
            advance(0, 1, *both, np.zeros(1, dtype=np.bool_), walls, TICK, 1)
        touched += sum(map(bool, engine.touch))
        rolled = ((engine.angles - angles)[:, :, None] * robots.motions).sum(axis=1)[:, :2] / TICK
        assert np.array_equal(engine.poses, motions.poses), "to the last bit"
        assert np.array_equal(engine.velocities, motions.velocities)
        assert np.abs(rolled - motions.rolled).max() < 1e-6, "differences of angles are less exact"
    assert touched > (20 if small else 50)


def test_machine_code_does_what_python_does() -> None:
    found = []
    for command in (motion.command, compiled(motion.command)):
        motions = motion.motions(1, 1, 2)[0]
        command(motions, motion.robots(MODELS[:1], 1)[0], 0, 0.6, 2.0, 0.5)
        found.append(repr(motions))
    assert found[0] == found[1] != repr(motion.motions(1, 1, 2)[0])


def test_a_robot_that_drives_sideways_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot drive sideways"):
        motion.robots([OMNI], 1)
