"""What the tests of CAN share: every test has a simulation of its own."""

import pytest

from tests.hal.can.handling import driving
from vrg.hal.can.protocols import PROTOCOLS
from vrg.registry import offered
from vrg.testing.can.bench import DeviceBench
from vrg.testing.can.fixtures import bench, drives, lab, protocol, watchdog

__all__ = ["bench", "drives", "lab", "protocol", "watchdog"]


def pytest_runtest_setup(item: pytest.Function) -> None:
    """Leave out what is tested with drives of a plug-in, where that is not installed."""
    values = item.callspec.params.values() if hasattr(item, "callspec") else ()
    named = {name for value in values for name in (value if isinstance(value, list) else [value]) if type(name) is str}
    missing = (named & offered(PROTOCOLS.group).keys()) - set(PROTOCOLS.names())
    if missing:
        pytest.skip(f"no {', '.join(sorted(missing))} without the plug-in")


@pytest.fixture
def going(bench: DeviceBench) -> DeviceBench:
    """The robot, armed and under way."""
    driving(bench)
    return bench
