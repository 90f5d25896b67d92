"""How a robot moves, by the match file in place of its model."""

from pathlib import Path

import pytest

from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg.hal.models import robot_model
from vrg.hal.models.settings import MOTION, with_motion
from vrg.hal.permission import Permission
from vrg.hal.sim.engines.engine import Start
from vrg.hal.sim.engines.planar import PlanarEngine
from vrg.hal.sim.map import load_map
from vrg.hal.sim.robot import VirtualRobot
from vrg.testing.tiny import TINY
from vrg.types import Pose, Twist


def test_every_number_can_be_set_and_the_others_stay() -> None:
    model = robot_model("P2AT")
    changed = with_motion(model, {"a_max": 0.5, "track": 0.7, "delay": 0.1})
    assert (changed.a_max, changed.delay, changed.v_max) == (0.5, 0.1, model.v_max)
    assert changed.drivetrain.effective_track == pytest.approx(0.7)
    assert with_motion(model, {}) is model
    assert all(with_motion(model, {name: low}) for name, (low, _) in MOTION.items())


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        ("{ a_max = 0.0 }", "players.2.motion.a_max: expected a number of at least 0.01 and at most 100, got 0.0"),
        ("{ speed = 1.0 }", "players.2.motion.speed: expected one of"),
        ("{ delay = true }", "players.2.motion.delay: expected a number"),
    ],
)
def test_mistakes_in_the_match_file_are_told(tmp_path: Path, motion: str, words: str) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(TINY.replace('name = "ann"', f'name = "ann"\nmotion = {motion}'))
    with pytest.raises(ConfigError) as caught:
        load_match(file)
    assert words in str(caught.value)
    file.write_text(TINY.replace('name = "ann"', 'name = "ann"\nmotion = { v_max = 0.4, delay = 0.1 }'))
    setup = load_match(file)
    assert setup.player("ann").robot.v_max == 0.4, "strategies and the device know it"
    assert [robot.description.delay for robot in setup.world.robots] == [0.0, 0.1, 0.0], "and so does the world"


def ann(delay: float) -> tuple[PlanarEngine, VirtualRobot, Permission]:
    """A robot that acts on commands after a delay."""
    model = with_motion(robot_model("P2AT"), {"delay": delay})
    engine = PlanarEngine(load_map("open"), [Start("ann", model, Pose(0.0, 0.0, 0.0))])
    return engine, VirtualRobot("ann", model), Permission()


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.15])
def test_a_virtual_robot_acts_on_a_command_after_its_delay(delay: float) -> None:
    engine, robot, permission = ann(delay)
    begins = None
    for n in range(50):
        now = 0.02 * n
        if n % 5 == 0:
            robot.drive(now, Twist(0.5 if now >= 0.2 - 1e-9 else 0.0, 0.0), armed=True, estop=False)
        engine.command("ann", robot.decide(now, permission, estop=False))
        engine.step(0.02)
        if begins is None and engine.poses[0, 0] > 0.0:
            begins = now
    assert begins == pytest.approx(0.2 + delay, abs=0.011)


@pytest.mark.parametrize("delay", [0.0, 0.4])
def test_what_was_commanded_before_a_stop_is_forgotten(delay: float) -> None:
    """After a silence, or an emergency stop, a robot that is commanded to stand does not move, however late it acts."""
    engine, robot, permission = ann(delay)

    def go(since: float, seconds: float, twist: Twist | None, *, armed: bool = True, estop: bool = False) -> float:
        """Let time pass, and return by how much the robot moves."""
        before = engine.poses[0, 0]
        for n in range(round(seconds / 0.02)):
            now = since + 0.02 * n
            if twist is not None and n % 5 == 0:
                robot.drive(now, twist, armed=armed, estop=estop)
            engine.command("ann", robot.decide(now, permission, estop=estop))
            engine.step(0.02)
        return engine.poses[0, 0] - before

    assert go(0.0, 1.0, Twist(0.5, 0.0)) > 0.0
    assert go(1.0, 10.0, None) > 0.0, "it brakes once its watchdog has expired"
    assert go(11.0, 1.0, Twist(0.0, 0.0)) == 0.0
    assert go(12.0, 1.0, Twist(0.5, 0.0)) > 0.0
    robot.stop()
    go(13.0, 1.0, Twist(0.5, 0.0), estop=True)
    go(14.0, 0.1, Twist(0.5, 0.0), armed=False)
    assert go(14.1, 1.0, Twist(0.0, 0.0)) == 0.0
