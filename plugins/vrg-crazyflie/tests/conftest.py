"""What the tests of Crazyflies share."""

from collections.abc import Iterator

import pytest
from bench import CrazyflieBench


@pytest.fixture
def bench() -> Iterator[CrazyflieBench]:
    """An emulated Crazyflie, which nobody has connected yet."""
    with CrazyflieBench() as made:
        yield made
