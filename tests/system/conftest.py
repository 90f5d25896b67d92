"""The matches that system tests share, and those that they have to themselves."""

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg.testing.processes.arena import Arena, arena, start
from vrg.testing.processes.match import MINNOWS, LiveMatch, long_match, on_small_disk, patient
from vrg.testing.processes.programs import screen
from vrg.testing.requirements import missing

__all__ = ["arena", "start"]

FAULTS = pytest.mark.parametrize(
    "fault",
    [pytest.param(signal.SIGKILL, id="dies"), pytest.param(signal.SIGSTOP, id="hangs", marks=pytest.mark.thorough)],
)
"""A process dies, or freezes."""

STUCK_ONCE = """
from pathlib import Path

from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer

HANG, MARKER = Path(__file__).with_name("hang"), Path(__file__).with_name("was_stuck")


class Stuck(SharksAndMinnowsPlayer):
    def act(self, view):
        if HANG.exists():
            HANG.rename(MARKER)
            while True:
                pass
        return super().act(view)
"""
"""A strategy that hangs in its own code once the file `hang` is beside it."""


@pytest.fixture
def match(arena: Arena) -> LiveMatch:
    """The shared match, in play, with every minnow moving."""
    shared = arena.shared(patient(long_match("long")))
    shared.observer.wait_moving(*MINNOWS)
    return shared


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """A virtual screen on a display of its own."""
    with screen() as (name, _):
        yield name


@pytest.fixture
def small_disk(tmp_path: Path) -> Path:
    """A folder that can be a small disk to a match. Within `scripts/with-loopback` everybody may mount one."""
    folder = tmp_path / "small"
    folder.mkdir()
    if subprocess.run([*on_small_disk(folder), "true"], check=False, capture_output=True).returncode != 0:
        missing("no small disk can be mounted")
    return folder
