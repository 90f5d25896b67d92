"""The benchmarks run; what they measure is for people to read."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.system, pytest.mark.thorough]

FOLDER = Path(__file__).parents[2] / "benchmarks"


def run(benchmark: str) -> None:
    """Run a benchmark, whose options follow its name."""
    name, *options = benchmark.split()
    command = [sys.executable, str(FOLDER / f"{name}.py"), "--quick", "--json", *options]
    common = {**os.environ, "PYTHONPATH": str(FOLDER)}
    done = subprocess.run(command, env=common, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)


BENCHMARKS = [
    *("speed", "pushes", "scan", "bus", "delay", "startup", "stops", "listeners"),
    "speed --against HEAD --engine planar --robots 8",
    "perception --only time",
    "perception --only match",
    "../plugins/vrg-league/benchmarks/compare",
    "pursuit_evasion capture --courses table --engine planar",
]


@pytest.mark.parametrize("benchmark", BENCHMARKS)
def test_a_benchmark_runs_and_says_something_in_json(benchmark: str) -> None:
    run(benchmark)
