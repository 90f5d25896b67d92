"""The matches that system tests share, and those that they have to themselves."""

import contextlib
import itertools
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.requirements import missing
from tests.system.harness import MINNOWS, Match, long_match, on_small_disk, patient

FAULTS = pytest.mark.parametrize(
    "fault",
    [pytest.param(signal.SIGKILL, id="dies"), pytest.param(signal.SIGSTOP, id="hangs", marks=pytest.mark.thorough)],
)
"""A process dies, or freezes."""


class Arena:
    """Holds at most one match at a time: two would share two cores."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._numbers = itertools.count(1)
        self._shared: Match | None = None
        self._text = ""

    def shared(self, text: str) -> Match:
        """A long match in play that tests use one after the other; another one where the last test spoilt it."""
        if self._shared is None or self._text != text or not self._shared.healthy:
            self.clear()
            self._shared, self._text = self.start(text), text
        return self._shared

    def start(self, text: str, **options: object) -> Match:
        """A match of its own; the caller closes it."""
        self.clear()
        folder = self._folder / f"match{next(self._numbers)}"
        folder.mkdir()
        return Match(folder, text, **options).__enter__()  # type: ignore[arg-type]

    def clear(self) -> None:
        """End the shared match, if there is one; no process of it is left."""
        if self._shared is not None:
            match, self._shared = self._shared, None
            match.close()


@pytest.fixture(scope="session")
def arena(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Arena]:
    arena = Arena(tmp_path_factory.mktemp("arena"))
    yield arena
    arena.clear()


@pytest.fixture
def match(arena: Arena) -> Match:
    """The shared match, in play, with every minnow moving."""
    shared = arena.shared(patient(long_match("long")))
    shared.observer.wait_moving(*MINNOWS)
    return shared


@pytest.fixture
def start(arena: Arena) -> Iterator[Callable[..., Match]]:
    """Starts a match for one test alone; no process of it is left at the end."""
    with contextlib.ExitStack() as stack:

        def make(text: str, **options: object) -> Match:
            running = arena.start(text, **options)
            stack.callback(running.close)
            return running

        yield make


@contextlib.contextmanager
def screen() -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    """A virtual screen that a test may take away: its display and its process."""
    if shutil.which("Xvfb") is None:
        missing("Xvfb is not installed: no screen for windows")
    out, into = os.pipe()
    command = ["Xvfb", "-displayfd", str(into), "-screen", "0", "1280x800x24", "-nolisten", "tcp"]
    process = subprocess.Popen(command, pass_fds=[into], stderr=subprocess.DEVNULL)
    os.close(into)
    try:
        with os.fdopen(out) as answer:
            number = answer.readline().strip()
        assert number, "Xvfb found no free display"
        yield f":{number}", process
    finally:
        process.kill()
        process.wait()


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
