"""The fixtures of a robot with emulated drives on a simulated bus. A `conftest.py` imports those that it wants.

`protocol` and `watchdog` may be parametrized, or defined again.
"""

from collections.abc import Iterator
from typing import Any

import pytest

from vrg.hal.can.workshop.simulation import Simulation
from vrg.testing.can.bench import DeviceBench, Drives, Lab


@pytest.fixture(autouse=True)
def lab() -> Iterator[Simulation]:
    """A simulation for one test."""
    Lab.simulation = Simulation(strict=True)
    yield Lab.simulation
    Lab.simulation.clock.close()


@pytest.fixture
def protocol() -> str:
    """What the drives speak; a test may be parametrized by it."""
    return "odrive"


@pytest.fixture
def watchdog() -> float:
    """s; 0 for drives without one, whose owner has said that this will do."""
    return 0.25


@pytest.fixture
def drives(protocol: str, watchdog: float) -> Iterator[Drives]:
    """The two drives of a robot."""
    with Drives(protocol, watchdog=watchdog) as drives:
        yield drives


@pytest.fixture
def bench(protocol: str, watchdog: float, drives: Drives) -> Iterator[DeviceBench]:
    """The robot, which nobody has connected yet."""
    wiring: dict[str, Any] = {} if watchdog else {"watchdog": "unsafe"}
    with DeviceBench(protocol, **wiring) as bench:
        yield bench
