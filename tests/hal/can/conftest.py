"""What the tests of CAN share: every test has a simulation of its own."""

from collections.abc import Iterator

import pytest

from tests.hal.can.bench import Lab
from vrg.commands import can_options
from vrg.hal.can.workshop.simulation import Simulation


@pytest.fixture(autouse=True)
def lab() -> Iterator[Simulation]:
    """A simulation for one test."""
    Lab.simulation = Simulation(strict=True)
    yield Lab.simulation
    Lab.simulation.clock.close()


@pytest.fixture
def simulated(lab: Simulation, monkeypatch: pytest.MonkeyPatch) -> None:
    """`vrg can` uses the buses of the simulation."""
    monkeypatch.setattr(can_options, "medium", lambda: lab)
