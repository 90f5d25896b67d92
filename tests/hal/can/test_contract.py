"""The can backend keeps the robot's contract, whatever protocol its drives speak."""

from collections.abc import Iterator

import pytest

from tests.hal.can.bench import NODES, CanBench, Drives
from tests.hal.contract import RobotContract

pytestmark = pytest.mark.vcan


class OverProtocol(RobotContract):
    """Two axes, one a side."""

    protocol: str

    @pytest.fixture
    def bench(self) -> Iterator[CanBench]:
        left, right = NODES[self.protocol]
        with Drives(self.protocol, [*left, *right]):
            bench = CanBench(self.protocol, left, right)
            yield bench
            bench.close()


class TestOdrive(OverProtocol):
    protocol = "odrive"


class TestCia402(OverProtocol):
    protocol = "cia402"


class TestOdriveFourAxes(RobotContract):
    """Four motors on one bus, two a side."""

    @pytest.fixture
    def bench(self) -> Iterator[CanBench]:
        with Drives("odrive", [0, 1, 2, 3]):
            bench = CanBench("odrive", [0, 1], [2, 3])
            yield bench
            bench.close()
