"""The table of backends."""

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.errors import ConfigError
from vrg.hal.backends import BACKENDS, MatchContext, open_driver
from vrg.hal.models import robot_model
from vrg.hal.sim.driver import SimDriver


def context() -> MatchContext:
    return MatchContext(name="r", model=robot_model("P2AT"), keys=Keys("m"), mailbox=Mailbox())


def test_sim_is_built_in() -> None:
    driver = open_driver("sim", context())
    assert isinstance(driver, SimDriver)
    assert driver.name == "r"
    assert driver.features.name == "P2AT"
    assert not driver.physical


def test_an_unknown_backend_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"backend: expected one of can, ros, sim, got 'simm', did you mean 'sim'"):
        BACKENDS.get("simm")
