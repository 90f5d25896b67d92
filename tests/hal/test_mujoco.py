"""What only the mujoco engine has to prove."""

import hashlib
import random
from dataclasses import replace

import numpy as np
import pytest

from tests.arithmetic import printed, without_fma
from tests.hal.engine_bench import DT, ON_WHEELS, deepest_overlap, run
from vrg.hal.models import robot_model
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.engines.mujoco import MujocoEngine
from vrg.hal.sim.map import load_map
from vrg.hal.sim.shapes import Box
from vrg.regions import Circle
from vrg.testing.omni import OMNI
from vrg.types import STILL, Pose, Twist

MAP = load_map("courtyard")


def squeeze(seed: int) -> MujocoEngine:
    """A random crowd upon an obstacle, through which a kinematic body jumps about, 5 s later."""
    rng = np.random.default_rng(seed)
    x, y = [(at.x, at.y) for at in (MAP.circles[0], MAP.boxes[7])][seed % 2]
    size = rng.uniform(0.0, 1.5)

    def pose() -> Pose:
        return Pose(x + rng.uniform(-size, size), y + rng.uniform(-size, size), rng.uniform(-3.0, 3.0))

    jumper = Start("jumper", robot_model("P2AT"), pose(), kinematic=True)
    known = ("ATRV-Jr", "P2AT", "TurtleBot3")
    others = [Start(f"r{n}", robot_model(rng.choice(known)), pose()) for n in range(rng.integers(2, 12))]
    engine = MujocoEngine(MAP, [jumper, *others])
    for _ in range(50):
        engine.step(DT)
        engine.move("jumper", pose(), STILL)
        assert np.abs(engine.velocities).max() < 6.0, seed
    engine.move("jumper", Pose(0.0, 0.0, 0.0), STILL)
    run(engine, 4.0)
    return engine


@pytest.mark.parametrize("seeds", [range(20), pytest.param(range(20, 1000), marks=pytest.mark.thorough)], ids=len)
def test_bodies_that_begin_in_one_another_or_in_an_obstacle_are_eased_apart(seeds: range) -> None:
    for seed in seeds:
        engine = squeeze(seed)
        assert np.isfinite(engine.poses).all(), seed
        assert deepest_overlap(engine) < 0.005, seed


SUBTLE = 1.31
"""An angle in rad. The last bit of the C library's cosine of it varies with the processor."""
_FIRST, *_OTHERS = OMNI.drivetrain.wheels
SKEWED = replace(
    OMNI, drivetrain=replace(OMNI.drivetrain, wheels=(replace(_FIRST, heading=SUBTLE), *_OTHERS), rates=())
)
CROOKED = replace(
    load_map("open"),
    boxes=(Box(0.0, 0.0, 2.0 * SUBTLE, 1.8, 0.5), Box(1.8, 1.0, -1.1, 4.0, 0.3)),
    circles=(Circle(-2, 1, 0.4),),
)


def crowd() -> str:
    """A hash of all that nine robots of several kinds, one of them kinematic, do in 8,000 physics steps.

    They drive about at random between two boxes, a circle and one another, and begin again every 4 s.
    """
    draw, bits = random.Random(1), hashlib.sha256()
    models = [SKEWED, *map(robot_model, ON_WHEELS)]
    starts = [
        Start(f"r{n}", models[n % 4], Pose(n % 3 - 1.1, n // 3 - 0.9, draw.uniform(-3.0, 3.0)), n == 7)
        for n in range(9)
    ]
    engine = MujocoEngine(CROOKED, starts)
    touched = 0
    for step in range(4000):
        for row, start in enumerate(starts):
            if start.kinematic:
                x, y, theta = engine.poses[row].tolist()
                engine.move(start.name, Pose(x + 0.004, y - 0.004, theta + 0.01), Twist(0.2, 0.5, 0.1))
            elif step % 25 == row:
                engine.command(start.name, Twist(draw.uniform(-0.3, 0.7), draw.uniform(-1.0, 1.0)))
            if step % 200 == 199:
                engine.place(start.name, start.pose)
        engine.step(DT)
        touched += sum(map(bool, engine.touch))
        bits.update(repr((engine.poses.tolist(), engine.velocities.tolist(), engine.touch)).encode())
    return f"{touched} touches {bits.hexdigest()}"


def test_the_same_bits_come_out_on_every_processor() -> None:
    here, there = printed("from tests.hal.test_mujoco import crowd; print(crowd())", without_fma())
    assert here == there
    assert int(here.split()[0]) > 5000
