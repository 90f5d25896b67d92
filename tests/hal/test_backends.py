"""The table of backends."""

from importlib.metadata import EntryPoint

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.errors import ConfigError
from vrg.hal import backends
from vrg.hal.backends import RobotContext, backend_names, open_robot
from vrg.hal.models import robot_model
from vrg.hal.sim.robot import SimRobot


def context() -> RobotContext:
    return RobotContext(name="r", model=robot_model("P2AT"), keys=Keys("m"), mailbox=Mailbox())


def plug(monkeypatch: pytest.MonkeyPatch, *entries: tuple[str, str]) -> None:
    made = [EntryPoint(name, value, backends.GROUP) for name, value in entries]
    monkeypatch.setattr(backends, "entry_points", lambda group: made)


def test_sim_is_built_in() -> None:
    assert "sim" in backend_names()
    robot = open_robot("sim", context())
    assert isinstance(robot, SimRobot)
    assert robot.name == "r"
    assert robot.features.name == "P2AT"


def test_an_unknown_backend_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"expected one of .*sim.*got 'simm', did you mean 'sim'"):
        open_robot("simm", context())


def test_a_plugin_adds_a_backend(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, ("mine", "vrg.hal.sim.robot:SimRobot"))
    assert {"mine", "sim"} <= set(backend_names())
    assert isinstance(open_robot("mine", context()), SimRobot)


def test_a_broken_plugin_does_not_empty_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, ("broken", "no_such_package.robot:Robot"))
    assert isinstance(open_robot("sim", context()), SimRobot)
    with pytest.raises(ConfigError, match="backend broken: cannot import no_such_package"):
        open_robot("broken", context())


def test_a_plugin_cannot_take_a_built_in_name(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, ("sim", "no_such_package:Robot"))
    assert isinstance(open_robot("sim", context()), SimRobot)
