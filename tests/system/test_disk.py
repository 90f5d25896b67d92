"""The disk of the run folder is full: play goes on or halts with the reason, and nothing written is lost."""

import contextlib
import os
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from vrg.bus.messages import OfficialAction
from vrg.coordinator.journal import read_journal
from vrg.errors import VrgError
from vrg.recording.reader import read_tracks
from vrg.runs.run_folder import RunFolder
from vrg.testing.processes.match import PLAYERS, LiveMatch, long_match
from vrg.testing.processes.observer import Observer
from vrg.testing.waiting import wait_until

pytestmark = [pytest.mark.system, pytest.mark.thorough]


def fill(path: Path) -> None:
    """Write until nothing more fits."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT)
    with contextlib.suppress(OSError):
        while os.write(descriptor, bytes(4096)):
            pass
    os.close(descriptor)


FULL = "No space left on device: free some space"


def full_or_scored(observer: Observer, score: int) -> bool:
    if observer.stalled:
        observer.resume()
    return FULL in (observer.state.halted or "") or observer.state.score["sharks"] == score


def recorded(run: RunFolder) -> bool:
    """Whether the recorder has written something of everybody: it writes once a second."""
    with contextlib.suppress(VrgError, OSError):
        return set(read_tracks(run.recording)) == set(PLAYERS)
    return False


@contextlib.contextmanager
def still_open(folder: Path) -> Iterator[Path]:
    """The folder, also when the name space in which its disk was mounted is gone."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        yield Path(f"/proc/self/fd/{descriptor}")
    finally:
        os.close(descriptor)


def test_a_full_disk_halts_the_match_and_loses_nothing(start: Callable[..., LiveMatch], small_disk: Path) -> None:
    match = start(long_match("crowded"), small_disk=small_disk)
    observer = match.observer
    wait_until(lambda: recorded(match.run), "the recorder to have written something")
    filler = match.run.path / "filler"
    fill(filler)
    # Calls are journalled until the last page is full.
    for score in range(1, 50):
        observer.decide(OfficialAction.SET_SCORE, "sharks", str(score))
        fill(filler)
        observer.wait_until(partial(full_or_scored, observer, score), "the score or a halt")
        if FULL in (observer.state.halted or ""):
            break
    assert FULL in (observer.state.halted or "")
    observer.wait_until(observer.standing, "all robots to stand")
    _, records = read_journal(match.run.journal)
    assert records[-1].standing.game["points"]["sharks"] == score - 1, "what was announced is what was written"
    assert set(read_tracks(match.run.recording)) == set(PLAYERS)
    observer.decide(OfficialAction.RESUME)
    observer.time_passes(0.5, "asked to resume on a full disk")
    assert observer.state.halted

    filler.unlink()
    match.resume()
    assert observer.state.score["sharks"] == score

    # A match that ends on a full disk ends without the file of its result.
    fill(filler)
    observer.time_passes(1.0, "on a full disk")
    match.launcher.send_signal(signal.SIGINT)
    with still_open(match.run.path) as path:
        run = RunFolder(path)
        assert match.wait_ended() == 130
        _, records = read_journal(run.journal)
        assert records[-1].standing.game["points"]["sharks"] == score
        assert set(read_tracks(run.recording)) == set(PLAYERS)
    assert "the result cannot be kept" in match.said()
    assert "Traceback" not in match.said()
