"""The backend `crazyflie` on an emulated one: the contract of drivers, and what only it does."""

from collections.abc import Iterator

import pytest
from bench import CrazyflieBench

from vrg.testing.driver import DriverContract

FIRM = 0.07
"""The time constant in s of the velocity of a Crazyflie that brakes as soon as the contract wants robots to: within
0.35 s. One with the gains of the firmware takes longer; see `test_how_soon_it_stands`."""
LOW = 0.25
"""The height in m from which it falls within the 0.3 s in which the contract wants a robot to stand after an emergency
stop."""


class TestCrazyflie(DriverContract):
    @pytest.fixture
    def bench(self) -> Iterator[CrazyflieBench]:
        with CrazyflieBench(response=FIRM, height=LOW) as made:
            yield made
