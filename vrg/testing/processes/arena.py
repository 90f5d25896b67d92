"""The fixtures of matches of real processes: one that tests share, and those that a test has to itself.

A `conftest.py` imports `arena` and `start`.
"""

import contextlib
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from vrg.testing.processes.match import LiveMatch


class Arena:
    """Holds at most one match at a time: two would share two cores."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._numbers = itertools.count(1)
        self._shared: LiveMatch | None = None
        self._text = ""

    def shared(self, text: str) -> LiveMatch:
        """A long match in play that tests use one after the other; another one where the last test spoilt it."""
        if self._shared is None or self._text != text or not self._shared.healthy:
            self.clear()
            self._shared, self._text = self.start(text), text
        return self._shared

    def start(self, text: str, **options: object) -> LiveMatch:
        """A match of its own; the caller closes it."""
        self.clear()
        folder = self._folder / f"match{next(self._numbers)}"
        folder.mkdir()
        return LiveMatch(folder, text, **options).__enter__()  # type: ignore[arg-type]

    def clear(self) -> None:
        """End the shared match, if there is one; no process of it is left."""
        if self._shared is not None:
            match, self._shared = self._shared, None
            match.close()


@pytest.fixture(scope="session")
def arena(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Arena]:
    """The matches of this run of tests."""
    arena = Arena(tmp_path_factory.mktemp("arena"))
    yield arena
    arena.clear()


@pytest.fixture
def start(arena: Arena) -> Iterator[Callable[..., LiveMatch]]:
    """Starts a match for one test alone; no process of it is left at the end."""
    with contextlib.ExitStack() as stack:

        def make(text: str, **options: object) -> LiveMatch:
            running = arena.start(text, **options)
            stack.callback(running.close)
            return running

        yield make
