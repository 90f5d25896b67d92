"""The benchmark of comparisons runs; what it measures is for people to read."""

from pathlib import Path

import pytest

from tests.system.test_benchmarks import run


@pytest.mark.system
@pytest.mark.thorough
def test_the_benchmark_of_comparisons_runs_and_says_something_in_json() -> None:
    run("compare", Path(__file__).parents[1] / "benchmarks")
