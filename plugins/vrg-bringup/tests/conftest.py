"""The fixtures of a simulated bus, which are those of VRG's own tests, and of the tools on it."""

from importlib.util import find_spec

import pytest

from tests.hal.can.conftest import bench, drives, going, lab, protocol, watchdog
from vrg.commands import drives as drives_command
from vrg.hal.can.workshop.simulation import Simulation

__all__ = ["bench", "drives", "going", "lab", "protocol", "simulated", "watchdog"]


collect_ignore = [] if find_spec("vrg_drives") else ["test_drives_commands.py", "test_drives_tools.py"]


@pytest.fixture
def simulated(lab: Simulation, monkeypatch: pytest.MonkeyPatch) -> None:
    """`vrg can` uses the buses of the simulation."""
    monkeypatch.setattr(drives_command, "medium", lambda: lab)
