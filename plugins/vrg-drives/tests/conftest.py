"""The fixtures of a robot on a simulated bus, of the tools on it, and of matches: most are those of VRG's own tests."""

import pytest

from tests.hal.can.conftest import bench, drives, going, lab, protocol, watchdog
from tests.system.conftest import arena, start
from vrg.commands import drives as drives_command
from vrg.hal.can.workshop.simulation import Simulation

__all__ = ["arena", "bench", "drives", "going", "lab", "protocol", "simulated", "start", "watchdog"]


@pytest.fixture
def simulated(lab: Simulation, monkeypatch: pytest.MonkeyPatch) -> None:
    """`vrg can` uses the buses of the simulation."""
    monkeypatch.setattr(drives_command, "medium", lambda: lab)
