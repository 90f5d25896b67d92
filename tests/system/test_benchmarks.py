"""The benchmarks run; what they measure is for people to read."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.system

FOLDER = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize("name", ["speed", "scan", "bus", "delay"])
def test_a_benchmark_runs(name: str) -> None:
    run(name)


@pytest.mark.vcan
@pytest.mark.parametrize("parts", [[], ["--only", "estop"]], ids=["robots", "match"])
def test_the_benchmark_of_can_runs(parts: list[str]) -> None:
    run("can", *parts)


def run(name: str, *options: str) -> None:
    done = subprocess.run(
        [sys.executable, str(FOLDER / f"{name}.py"), "--quick", "--json", *options],
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)
