"""`vrg` commands in processes of their own, which end with the process that has started them, whoever kills that.

`python -P -m vrg.playing.by_command COMMAND...` is such a process: it is stopped when its standard input is closed.
"""

import os
import runpy
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from vrg.bus.stopping import Stop
from vrg.errors import LaunchError
from vrg.launch.process_main import held
from vrg.playing.run import Run

_LOOKED: Final = 0.2
"""The real time in s between two looks at whether a match has ended."""
_STOPPED: Final = 30.0
"""The real time in s that a command has to stop in order."""


def started(arguments: Sequence[str], *, before: Sequence[str] = (), **how: Any) -> "subprocess.Popen[bytes]":
    """A `vrg` command that was started. A folder that this process owns belongs to it, too: see `folder_lock.owned`.

    Args:
        before: the words before the command, such as `nice`. how: further arguments of `subprocess.Popen`.
    """
    command = [*before, sys.executable, "-P", "-m", __name__, *arguments]
    return subprocess.Popen(command, stdin=subprocess.PIPE, close_fds=False, **how)


def play_file(file: Path, runs: Path, options: Sequence[str], stop: Stop | None = None) -> Run:
    """Play a match file by `vrg play`, with all that people see of it; the run that it has left.

    Args:
        runs: the folder of its run folder. options: further ones of `vrg play`. stop: breaks the match off.

    Raises:
        LaunchError: it has left no result.
    """
    before = {run.name for run in runs.glob("*")}
    with started(["play", str(file), "--runs", str(runs), *options]) as process:
        while stop is not None and process.poll() is None:
            if stop.wait(_LOOKED):
                process.send_signal(signal.SIGINT)
                break
        status = process.wait()
    new = sorted(run for run in runs.glob("*") if run.name not in before)
    if not new or not (new[-1] / "result.json").is_file():
        raise LaunchError(f"{file}: the match did not reach its end (status {status})")
    return Run(new[-1])


def _hold_leash() -> None:
    while held():
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_STOPPED)
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_hold_leash, daemon=True).start()
    runpy.run_module("vrg", run_name="__main__")
