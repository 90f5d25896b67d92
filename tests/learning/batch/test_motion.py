"""The motion of a batch is that of the planar engine."""

import numpy as np
import pytest

from tests.outside.package.toys.kiwi import KIWI
from vrg.hal.models import robot_model
from vrg.hal.sim.engines.planar import PlanarEngine
from vrg.hal.sim.map import load_map
from vrg.learning.batch import motion
from vrg.learning.compiled import compiled
from vrg.types import Pose, Twist

MODELS = [robot_model(name) for name in ("P2AT", "ATRV-Jr", *["P2AT"] * 6)]


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.thorough) for n in range(1, 12))])
def test_robots_in_a_crowd_move_as_in_the_planar_engine(seed: int, small: bool) -> None:
    """They push one another and the walls of the courtyard, brake and are let go again, to the same places."""
    rng = np.random.default_rng(seed)
    ground = load_map("courtyard")
    engine, walls = PlanarEngine(ground), motion.walls_of(ground)
    robots, motions = motion.robots(MODELS, 1)[0], motion.motions(1, len(MODELS), 2)[0]
    advance, command, lock = compiled(motion.advance), compiled(motion.command), compiled(motion.lock)
    for n, model in enumerate(MODELS):
        x, y, theta = 17.0 + 1.1 * (n % 4) + rng.uniform(-0.1, 0.1), -14.5 - 1.1 * (n // 4), rng.uniform(-3.0, 3.0)
        engine.add(f"r{n}", model, Pose(x, y, theta))
        motions.poses[n] = x, y, theta
    touched = 0
    for _ in range(50 if small else 150):
        for n, model in enumerate(MODELS):
            if rng.random() < 0.05:
                engine.command(f"r{n}", None)
                lock(motions, n)
            else:
                twist = Twist(rng.uniform(-0.4, 1.0), rng.uniform(-2.4, 2.4))
                engine.command(f"r{n}", model.limited(twist))
                command(motions, robots, n, twist.v, twist.w, model.v_max)
        for _ in range(5):
            engine.step(0.02)
            advance(motions, robots, walls, 0.02)
        touched += sum(map(bool, engine.touch))
        # Two libraries may round sines otherwise, by less than a billionth of this.
        assert np.abs(engine.poses - motions.poses).max() < 1e-9
        assert np.abs(engine.velocities - motions.velocities).max() < 1e-6
    assert touched > (0 if small else 50)


def test_machine_code_does_what_python_does() -> None:
    found = []
    for command in (motion.command, compiled(motion.command)):
        motions = motion.motions(1, 1, 2)[0]
        command(motions, motion.robots(MODELS[:1], 1)[0], 0, 0.6, 2.0, 0.5)
        found.append(repr(motions))
    assert found[0] == found[1] != repr(motion.motions(1, 1, 2)[0])


def test_a_robot_that_drives_sideways_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot drive sideways"):
        motion.robots([KIWI], 1)
