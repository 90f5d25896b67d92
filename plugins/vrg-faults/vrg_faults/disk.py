"""The simulated disk of the referee's journal and evidence: it takes simulated time, and can be full or stalled."""

import errno
import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from random import Random
from typing import Final

from vrg.coordinator.journal import Journal, JournalHeader
from vrg.errors import JournalError
from vrg.hal.simulated_clock import SimulatedClock

TAKES: Final = (0.0005, 0.004)
"""The least and the most time in s that a job takes on a good disk."""


class Disk:
    """Does one job after the other, as the thread of a real journal does. It belongs to the machine of the referee.

    Args:
        clock: the simulated real time. random: draws how long each job takes.

    Attributes:
        full: True while nothing more fits on it.
    """

    def __init__(self, clock: SimulatedClock, random: Random) -> None:
        self.full = False
        self._clock, self._random = clock, random
        self._waiting: deque[tuple[Callable[[], None], Future[None]]] = deque()
        self._holds = 0
        self._round = 0
        self._busy = False

    @property
    def stalled(self) -> bool:
        """True while nothing gets done."""
        return self._holds > 0

    def do(self, job: Callable[[], None]) -> "Future[None]":
        """Do something after all that came before."""
        done: Future[None] = Future()
        self._waiting.append((job, done))
        self._go_on()
        return done

    def hold(self, held: bool) -> None:
        """Let nothing get done from now on, or go on: the disk stalls, or the thread of the journal is frozen."""
        self._holds += 1 if held else -1
        self._go_on()

    def abandon(self) -> None:
        """The process that waits for the jobs has died. Some of the first may be done anyway."""
        for _ in range(0 if self.stalled else self._random.randint(0, len(self._waiting))):
            self._finish()
        self._waiting.clear()
        self._round += 1
        self._busy = False

    def _go_on(self) -> None:
        if self._waiting and not self._busy and not self.stalled:
            self._busy = True
            at, of = self._clock.now() + self._random.uniform(*TAKES), self._round
            self._clock.at(at, lambda: self._done(of))

    def _done(self, of: int) -> None:
        if of != self._round:
            return
        self._busy = False
        if not self.stalled:
            self._finish()
            self._go_on()

    def _finish(self) -> None:
        job, done = self._waiting.popleft()
        try:
            job()
            done.set_result(None)
        except JournalError as error:
            done.set_exception(error)


class SimulatedJournal(Journal):
    """A journal on a simulated disk.

    Args:
        path, header: as for `Journal`. disk: the disk.

    Raises:
        JournalError: as for `Journal`.
    """

    def __init__(self, path: Path, header: JournalHeader, disk: Disk) -> None:
        self._disk = disk
        super().__init__(path, header)

    def _do(self, job: Callable[[], None]) -> "Future[None]":
        return self._disk.do(job)

    def _put(self, file: int, data: bytes, at: int) -> int:
        if self._disk.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super()._put(file, data, at)

    def _sync(self) -> None:
        """Do nothing: the computer of a simulated match does not fail, and real disks are slow."""
