"""The benchmarks run; what they measure is for people to read."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.system, pytest.mark.thorough]

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize("name", ["speed", "pushes", "scan", "bus", "delay", "startup", "compare", "stops"])
def test_a_benchmark_runs(name: str) -> None:
    run(name)


def test_the_benchmarks_of_pursuit_run() -> None:
    run("perception", "--only", "time")
    run("perception", "--only", "match")
    run("pursuit_evasion", "capture", "--courses", "table", "--engine", "planar")


def run(name: str, *options: str) -> None:
    """Run one quickly; it succeeds and says something in JSON."""
    done = subprocess.run(
        [sys.executable, str(FOLDER / f"{name}.py"), "--quick", "--json", *options],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)
