"""The driver of CAN robots keeps the contract of drivers, whatever protocol the drives speak."""

from collections.abc import Iterator

import pytest

from tests.hal.can.bench import HERE, NODES, CanBench, Drives
from vrg.testing.driver import DriverContract


class OverProtocol(DriverContract):
    """Two axes, one on each side."""

    protocol: str

    @pytest.fixture
    def bench(self) -> Iterator[CanBench]:
        left, right = NODES[self.protocol]
        with Drives(self.protocol, [*left, *right], link=HERE):
            bench = CanBench(self.protocol, left, right, link=HERE)
            yield bench
            bench.close()


class TestOdrive(OverProtocol):
    protocol = "odrive"


class TestCia402(OverProtocol):
    protocol = "cia402"


class TestMoteus(OverProtocol):
    protocol = "moteus"


class TestVesc(OverProtocol):
    protocol = "vesc"


class TestOdriveFourAxes(DriverContract):
    """Four motors on one bus, two on each side."""

    @pytest.fixture
    def bench(self) -> Iterator[CanBench]:
        with Drives("odrive", [0, 1, 2, 3]):
            bench = CanBench("odrive", [0, 1], [2, 3])
            yield bench
            bench.close()
