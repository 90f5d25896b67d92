"""The sim backend keeps the contract, on both engines."""

from collections.abc import Iterator

import pytest

from tests.hal.contract import RobotContract, armed
from tests.hal.world_bench import SimBench
from vrg.errors import RobotError


class TestPlanar(RobotContract):
    @pytest.fixture
    def bench(self) -> Iterator[SimBench]:
        bench = SimBench("planar")
        yield bench
        bench.close()

    def test_a_scan_arrives_with_angles_and_age(self, bench: SimBench) -> None:
        bench.robot.connect()
        bench.advance(0.5)
        scan = bench.robot.read().laser
        assert scan is not None
        assert scan.ranges.shape == scan.angles.shape == (181,)
        assert scan.angles[90] == pytest.approx(0.0)
        assert scan.age <= 0.1

    def test_an_emergency_stop_that_came_and_went_unseen_disarms_it_too(self, bench: SimBench) -> None:
        armed(bench)
        bench.run(3.0, 3.0, 1.0)
        bench.node.world.engage(True)
        bench.node.world.engage(False)
        with pytest.raises(RobotError, match="arm"):
            bench.run(3.0, 3.0, 2.0)
        bench.robot.arm()  # in the very tick in which it found itself disarmed
        bench.run(3.0, 3.0, 1.0)
        assert bench.robot.read().armed
        assert bench.robot.read().v > 0.1


class TestPybullet(RobotContract):
    @pytest.fixture
    def bench(self) -> Iterator[SimBench]:
        bench = SimBench("pybullet")
        yield bench
        bench.close()
