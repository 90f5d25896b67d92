"""The disk of the referee's journal, on simulated time: each write takes some, and it can be full, stall, or tear."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from random import Random
from typing import Final

from vrg.coordinator.journal import Journal, JournalHeader
from vrg.errors import JournalError

WRITING: Final = (0.0002, 0.02)
"""The least and the most simulated real time in s that a write takes."""
After = Callable[[float, Callable[[], None]], None]
"""A function that lets something happen after some simulated real time, s."""
_Job = tuple[Callable[[], None], "Future[None]"]


class Disk:
    """Writes in the order in which it is asked to, one after the other, as the thread of a real journal does.

    Args:
        after: lets something happen later. random: how long each write takes.

    Attributes:
        full: True while it takes nothing.
        stalled: True while no write ends.
    """

    def __init__(self, after: After, random: Random) -> None:
        self.full = self.stalled = False
        self._after, self._random = after, random
        self._waiting: deque[_Job] = deque()
        self._busy: _Job | None = None

    def do(self, job: Callable[[], None]) -> "Future[None]":
        """Let a write wait for its turn."""
        done: Future[None] = Future()
        self._waiting.append((job, done))
        self._go_on()
        return done

    def stall(self, stalled: bool) -> None:
        """Let it do nothing from now on, or go on."""
        self.stalled = stalled
        self._go_on()

    def drop(self) -> None:
        """Forget the writes that wait, as their process has ended."""
        self._waiting.clear()
        self._busy = None

    def finish(self) -> None:
        """Do at once all that waits."""
        waiting, self._busy = self._waiting, None
        while waiting:
            _done(*waiting.popleft())

    def _go_on(self) -> None:
        if self._busy is None and self._waiting and not self.stalled:
            job = self._busy = self._waiting[0]
            whole = self._random.uniform(*WRITING)
            # What is on disk already is not yet known to be: a process may end in between.
            self._after(self._random.random() * whole, partial(self._write, job, whole))

    def _write(self, job: _Job, whole: float) -> None:
        if self._busy is not job:
            return
        self._waiting.popleft()
        error = _failure(job[0])
        self._after(0.5 * whole, partial(self._answer, job, error))

    def _answer(self, job: _Job, error: JournalError | None) -> None:
        if self._busy is not job:
            return
        self._busy = None
        _settle(job[1], error)
        self._go_on()


def _failure(job: Callable[[], None]) -> JournalError | None:
    try:
        job()
    except JournalError as error:
        return error
    return None


def _settle(done: "Future[None]", error: JournalError | None) -> None:
    if error is None:
        done.set_result(None)
    else:
        done.set_exception(error)


def _done(job: Callable[[], None], done: "Future[None]") -> None:
    _settle(done, _failure(job))


class FaultyJournal(Journal):
    """A journal on such a disk.

    Args:
        path, header: see `vrg.coordinator.journal.Journal`. disk: where it is.
    """

    def __init__(self, path: Path, header: JournalHeader, disk: Disk) -> None:
        self.disk = disk
        super().__init__(path, header)

    def _do(self, job: Callable[[], None]) -> "Future[None]":
        return self.disk.do(job)

    def _write(self, at: int, data: bytes) -> None:
        if self.disk.full:
            raise JournalError(f"{self.path}: cannot be written: no space left: free some space")
        super()._write(at, data)

    def close(self) -> None:
        """Forget what has not been written, and close the files. Idempotent."""
        self.disk.drop()
        super().close()


def tear(*files: Path) -> None:
    """Leave half a line at the end of files, as a process does that ends while it writes."""
    for file in files:
        with file.open("ab") as opened:
            opened.write(b'{"n":7,"time":1.2' if file.suffix != ".bin" else b"\x00\x00")
