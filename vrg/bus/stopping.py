"""How a process is told to stop."""

import contextlib
import logging
import os
import select
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol

log = logging.getLogger(__name__)


class StopSignal(Protocol):
    """What a loop looks at: `threading.Event` is one, too."""

    def is_set(self) -> bool:
        """Whether it is time to stop."""

    def wait(self, timeout: float) -> bool:
        """Wait until it is, at most `timeout` seconds of real time; whether it is."""


class Stop:
    """A StopSignal that a signal handler may set.

    A handler runs inside whatever the main thread was doing: setting a `threading.Event` there deadlocks when the main
    thread was just then inside that event's own wait. A pipe has no lock.
    """

    def __init__(self) -> None:
        self.signal: int | None = None
        self._set = False
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)

    def set(self, number: int | None = None) -> None:
        """Stop, because of signal `number` if it was one."""
        self._set = True
        self.signal = self.signal or number
        with contextlib.suppress(BlockingIOError):
            os.write(self._writer, b".")

    def is_set(self) -> bool:
        """Whether it is time to stop."""
        return self._set

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is, at most `timeout` seconds of real time; whether it is."""
        if not self._set:
            select.select([self._reader], [], [], timeout)
        return self._set

    @property
    def interrupted(self) -> bool:
        """Whether it was Ctrl-C."""
        return self.signal == signal.SIGINT


@contextmanager
def stop_on_signals() -> Iterator[Stop]:
    """A Stop that SIGINT and SIGTERM set; the handlers are put back at the end."""
    stop = Stop()

    def handle(number: int, _frame: FrameType | None) -> None:
        stop.set(number)

    before = {number: signal.signal(number, handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if stop.signal is not None:
            log.info("stopped by %s", signal.Signals(stop.signal).name)
