"""The benchmark of CAN runs; what it measures is for people to read."""

import pytest

from tests.system.test_benchmarks import run


@pytest.mark.vcan
@pytest.mark.thorough
def test_it_runs() -> None:
    run("can")
