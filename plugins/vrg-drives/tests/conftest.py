"""The fixtures of a robot on a simulated bus, of the tools on it, and of matches."""

import pytest
from can_tools import node

from vrg.commands import drives as drives_command
from vrg.hal.can.workshop.simulation import Simulation
from vrg.testing.can.fixtures import bench, drives, lab, protocol, watchdog
from vrg.testing.processes.arena import arena, start

__all__ = ["arena", "bench", "drives", "lab", "node", "protocol", "simulated", "start", "watchdog"]


@pytest.fixture
def simulated(lab: Simulation, monkeypatch: pytest.MonkeyPatch) -> None:
    """`vrg can` uses the buses of the simulation."""
    monkeypatch.setattr(drives_command, "medium", lambda: lab)
