"""`vrg can ...` as a user types it, on vcan0."""

import contextlib
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from vrg.hal.can.bus import CanBus
from vrg.hal.can.frame import Frame
from vrg.testing.can.vcan import INTERFACE, VCAN
from vrg.testing.waiting import wait_until

PATIENCE = 180.0
ON = ("--channel", INTERFACE)
LATE = "no heartbeat|nothing has been heard from the bus|no setpoint came|did not run for|but it is idle"
"""What a tool says of drives where it, or the process that emulates them, did not get to run in time."""


def vrg(*arguments: str, said: str = "") -> subprocess.CompletedProcess[str]:
    """Run a command of vrg's to its end; `said` is what is typed."""
    command = [sys.executable, "-m", "vrg", *arguments]
    return subprocess.run(command, input=said, capture_output=True, text=True, timeout=PATIENCE, check=False)


def turn(*arguments: str, said: str = "") -> subprocess.CompletedProcess[str]:
    """Run a command that turns motors, once more where this computer was too busy for them: drives do not wait."""
    for _ in range(5):
        done = vrg(*arguments, said=said)
        if done.returncode == 0 or not re.search(LATE, " ".join((done.stdout + done.stderr).split())):
            break
    return done


def told(pattern: str, done: subprocess.CompletedProcess[str]) -> float:
    """The number in what a command has printed that the pattern's group matches."""
    found = re.search(pattern, done.stdout)
    assert found is not None, done.stdout
    return float(found[1])


@pytest.fixture
def node(tmp_path: Path) -> Iterator[Callable[..., "subprocess.Popen[bytes]"]]:
    """Starts `vrg node drives`; all of them end with the test."""
    with contextlib.ExitStack() as stack:

        def start(*arguments: str) -> "subprocess.Popen[bytes]":
            out = tmp_path / f"node{len(list(tmp_path.iterdir()))}.txt"
            with out.open("wb") as file:
                process = subprocess.Popen(
                    [sys.executable, "-m", "vrg", "node", "drives", *ON, *arguments], stdout=file
                )
            stack.callback(process.wait, PATIENCE)
            stack.callback(process.terminate)
            wait_until(lambda: b"emulating" in out.read_bytes(), "the drives to be on the bus")
            return process

        yield start


def monitored() -> tuple[str, list[Frame]]:
    """What `vrg can monitor` shows, and all that is on the bus meanwhile."""
    heard: list[Frame] = []
    bus = CanBus(VCAN, heard.append)
    bus.start()
    done = vrg("can", "monitor", *ON, "--for", "1.5")
    bus.stop()
    return done.stdout, heard
