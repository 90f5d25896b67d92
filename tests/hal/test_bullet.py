"""What only the pybullet engine has to prove."""

import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

from tests.hal.engine_bench import ON_WHEELS, drive, forward, run
from vrg.hal.models import robot_model
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.map import load_map
from vrg.types import Pose

pybullet = pytest.importorskip("pybullet")
from vrg.hal.sim.engines.pybullet import BulletEngine  # noqa: E402 - only where there are wheels of it

Make = Callable[[str], BulletEngine]


@pytest.fixture
def make() -> Iterator[Make]:
    """A builder of engines on open ground with robot a of a model."""
    made: list[BulletEngine] = []

    def build(name: str) -> BulletEngine:
        made.append(BulletEngine(load_map("open"), [Start("a", robot_model(name), Pose(0, 0, 0))]))
        return made[-1]

    yield build
    for engine in made:
        engine.close()


@pytest.mark.parametrize("name", ON_WHEELS)
def test_a_full_brake_does_not_tip_it(make: Make, name: str) -> None:
    engine = make(name)
    drive(engine, "a", robot_model(name).v_max, seconds=2.0)
    engine.command("a", None)
    for _ in range(50):
        run(engine, 0.02)
        place, turn = pybullet.getBasePositionAndOrientation(engine._bodies[0], physicsClientId=engine._client)
        roll, pitch, _ = pybullet.getEulerFromQuaternion(turn)
        assert abs(roll) < 0.02
        assert abs(pitch) < 0.02
        assert place[2] == pytest.approx(robot_model(name).drivetrain.wheel_radius, abs=0.005)


def test_a_collision_does_not_tip_it() -> None:
    heavy = Start("a", robot_model("ATRV-Jr"), Pose(-2.0, -1.0, 2.8))
    engine = BulletEngine(load_map("marhes_lab"), [heavy, Start("b", robot_model("P2AT"), Pose(0.5, -1.0, 3.1))])
    for name in engine.names:
        forward(engine, name, 1.0)
    for _ in range(300):
        run(engine, 0.02)
        for body in engine._bodies:
            _, turn = pybullet.getBasePositionAndOrientation(body, physicsClientId=engine._client)
            roll, pitch, _ = pybullet.getEulerFromQuaternion(turn)
            assert max(abs(roll), abs(pitch)) < 0.05
    engine.close()


def test_closing_twice_is_fine_and_lets_go_of_the_client(make: Make) -> None:
    engine = make("P2AT")
    client = engine._client
    engine.close()
    engine.close()
    assert not pybullet.isConnected(client)


@pytest.mark.parametrize("module", ["vrg.hal.sim.engines.pybullet", "vrg.hal.sim.sensors.renderer"])
def test_the_import_of_pybullet_prints_nothing(module: str) -> None:
    program = f"import sys, {module}; print('after', file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=300)
    assert (done.stdout, done.stderr) == ("", "after\n")
