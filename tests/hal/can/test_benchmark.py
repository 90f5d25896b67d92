"""The benchmark of CAN runs; what it measures is for people to read."""

import pytest

from tests.system.test_benchmarks import run


@pytest.mark.vcan
@pytest.mark.parametrize("parts", [[], ["--only", "estop"]], ids=["robots", "match"])
def test_it_runs(parts: list[str]) -> None:
    run("can", *parts)
