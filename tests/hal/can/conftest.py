"""What the tests of CAN share: every test has a simulation of its own."""

from collections.abc import Iterator

import pytest

from tests.hal.can.bench import DeviceBench, Drives, Lab
from tests.hal.can.handling import driving
from vrg.hal.can.protocols import PROTOCOLS
from vrg.hal.can.workshop.simulation import Simulation
from vrg.registry import offered


def pytest_runtest_setup(item: pytest.Function) -> None:
    """Leave out what is tested with drives of a plug-in, where that is not installed."""
    values = item.callspec.params.values() if hasattr(item, "callspec") else ()
    named = {name for value in values for name in (value if isinstance(value, list) else [value]) if type(name) is str}
    missing = (named & offered(PROTOCOLS.group).keys()) - set(PROTOCOLS.names())
    if missing:
        pytest.skip(f"no {', '.join(sorted(missing))} without the plug-in")


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
    with DeviceBench(protocol, **({} if watchdog else {"watchdog": "unsafe"})) as bench:
        yield bench


@pytest.fixture
def going(bench: DeviceBench) -> DeviceBench:
    """The robot, armed and under way."""
    driving(bench)
    return bench
