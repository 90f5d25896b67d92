"""Whatever happens to a robot with CAN drives, it stands half a second later (docs/safety.md)."""

import pytest

from tests.hal.can.rest import CAUSES, time_to_rest
from vrg.hal.can.workshop.simulation import Simulation
from vrg.testing.can.bench import NODES, Lab

REST, DEAF = 0.45, 0.47
"""s; and of an ODrive that hears nothing and speaks on, whose heartbeat tells that its watchdog has stopped it."""


@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.parametrize("protocol", NODES)
@pytest.mark.parametrize("lives", [2, pytest.param(40, marks=pytest.mark.thorough)])
def test_it_stands_soon(protocol: str, cause: str, lives: int) -> None:
    for seed in range(lives):
        Lab.simulation = Simulation(strict=True)
        most = DEAF if (protocol, cause) == ("odrive", "a drive hears nothing") else REST
        assert 0.0 < time_to_rest(protocol, cause, seed) <= most, f"seed {seed}"
        Lab.simulation.clock.close()
