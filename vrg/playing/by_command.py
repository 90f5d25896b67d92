"""A match that is played by `vrg play` in processes of its own, with all that people see of it."""

import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from vrg.bus.stopping import Stop
from vrg.errors import LaunchError
from vrg.runs.run import Run

_LOOKED: Final = 0.2
"""The real time in s between two looks at whether a match has ended."""


def play_file(file: Path, runs: Path, options: Sequence[str], stop: Stop | None = None) -> Run:
    """Play a match file; the run that it has left.

    Args:
        runs: the folder of its run folder. options: further ones of `vrg play`. stop: breaks the match off.

    Raises:
        LaunchError: it has left no result.
    """
    before = {run.name for run in runs.glob("*")}
    command = [sys.executable, "-P", "-m", "vrg", "play", str(file), "--runs", str(runs), *options]
    with subprocess.Popen(command) as process:
        while stop is not None and process.poll() is None:
            if stop.wait(_LOOKED):
                process.send_signal(signal.SIGINT)
                break
        status = process.wait()
    new = sorted(run for run in runs.glob("*") if run.name not in before)
    if not new or not (new[-1] / "result.json").is_file():
        raise LaunchError(f"{file}: the match did not come to its end (status {status})")
    return Run(new[-1])
