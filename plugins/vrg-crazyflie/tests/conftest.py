"""What the tests of Crazyflies share."""

from collections.abc import Iterator

import pytest
from crazyflie_bench import CrazyflieBench

from vrg.testing.processes.arena import arena, start

__all__ = ["arena", "bench", "start"]


@pytest.fixture
def bench() -> Iterator[CrazyflieBench]:
    """An emulated Crazyflie, which nobody has connected yet."""
    with CrazyflieBench() as made:
        yield made
