"""What only the mujoco engine has to prove."""

import numpy as np
import pytest

from tests.hal.engine_bench import DT, deepest_overlap, run
from vrg.hal.models import MODELS, robot_model
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.engines.mujoco import MujocoEngine
from vrg.hal.sim.map import load_map
from vrg.types import STILL, Pose

MAP = load_map("courtyard")


def squeeze(seed: int) -> MujocoEngine:
    """A random crowd upon an obstacle, through which a kinematic body jumps about, 5 s later."""
    rng = np.random.default_rng(seed)
    x, y = [(at.x, at.y) for at in (MAP.circles[0], MAP.boxes[7])][seed % 2]
    size = rng.uniform(0.0, 1.5)

    def pose() -> Pose:
        return Pose(x + rng.uniform(-size, size), y + rng.uniform(-size, size), rng.uniform(-3.0, 3.0))

    jumper = Start("jumper", robot_model("P2AT"), pose(), kinematic=True)
    others = [Start(f"r{n}", robot_model(rng.choice(MODELS.names())), pose()) for n in range(rng.integers(2, 12))]
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
