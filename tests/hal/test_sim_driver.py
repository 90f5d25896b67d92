"""The driver of a robot in the world keeps the contract, on both engines."""

from collections.abc import Iterator

import pytest

from tests.hal.world_bench import SimBench
from vrg.errors import RobotError
from vrg.hal.sensors.laser import Laser
from vrg.testing.driver import FORWARD, DriverContract, armed


class TestPlanar(DriverContract):
    @pytest.fixture
    def bench(self) -> Iterator[SimBench]:
        bench = SimBench("planar")
        yield bench
        bench.close()

    def test_a_scan_arrives_with_angles_and_age(self, bench: SimBench) -> None:
        bench.driver.connect()
        bench.advance(0.5)
        scan = bench.driver.read().latest(Laser)
        assert scan is not None
        assert scan.value.ranges.shape == scan.value.angles.shape == (181,)
        assert scan.value.angles[90] == pytest.approx(0.0)
        assert scan.age <= 0.1

    def test_an_emergency_stop_that_came_and_went_unseen_disarms_it_too(self, bench: SimBench) -> None:
        armed(bench)
        bench.run(FORWARD, 1.0)
        bench.node.world.engage(True)
        bench.node.world.engage(False)
        with pytest.raises(RobotError, match="arm"):
            bench.run(FORWARD, 2.0)
        bench.driver.arm()  # in the very tick in which it found itself disarmed
        bench.run(FORWARD, 1.0)
        assert bench.driver.read().armed
        assert bench.speed > 0.1


class TestPybullet(DriverContract):
    @pytest.fixture
    def bench(self) -> Iterator[SimBench]:
        bench = SimBench("pybullet")
        yield bench
        bench.close()
