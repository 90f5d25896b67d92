"""The signal by which a process must stop."""

import contextlib
import logging
import math
import os
import select
import signal
import socket
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol

from vrg.system import POSIX, in_main_thread

log = logging.getLogger(__name__)

_LOOK = 0.1
"""The real time in s after which a signal is handled on Windows, and after which another StopSignal is looked at."""


class StopSignal(Protocol):
    """The signal by which a loop must stop. A `threading.Event` can be used as one, too."""

    def is_set(self) -> bool:
        """True if it is time to stop."""

    def wait(self, timeout: float) -> bool:
        """Wait at most `timeout` seconds of real time until it is time to stop; return whether it is."""


class Stop:
    """A StopSignal that a signal handler may set.

    A handler interrupts the main thread at any point. If the main thread is just then inside a `threading.Event`'s own
    `wait`, setting that event in the handler deadlocks. A socket has no lock, so it can always be written to.

    Args:
        also: another StopSignal, which stops this one, too.

    Attributes:
        signal: the signal that has asked for it; None if none has.
        interrupts: True while code runs that never looks at it: a further Ctrl-C interrupts that.
    """

    def __init__(self, also: StopSignal | None = None) -> None:
        self.signal: int | None = None
        self.interrupts = False
        self._set, self._also = False, also
        self._reader, self._writer = socket.socketpair()
        self._writer.setblocking(False)

    def set(self, number: int | None = None) -> None:
        """Ask for the stop; `number` is the signal that asks for it, if it is one."""
        self._set = True
        self.signal = self.signal or number
        with contextlib.suppress(BlockingIOError):
            self._writer.send(b".")

    def is_set(self) -> bool:
        """True if it is time to stop."""
        return self._set or (self._also is not None and self._also.is_set())

    def wait(self, timeout: float | None = None) -> bool:
        """Wait at most `timeout` seconds of real time until it is time to stop; return whether it is."""
        # On Windows a signal does not end a wait; it is handled between two.
        longest = _LOOK if self._also is not None or not POSIX else math.inf
        deadline = time.monotonic() + (math.inf if timeout is None else timeout)
        while not self.is_set() and (left := min(longest, deadline - time.monotonic())) > 0.0:
            select.select([self._reader], [], [], None if left == math.inf else left)
        return self.is_set()

    @property
    def interrupted(self) -> bool:
        """True if Ctrl-C was the reason to stop."""
        return self.signal == signal.SIGINT


@contextmanager
def stop_on_signals(also: StopSignal | None = None) -> Iterator[Stop]:
    """A Stop that SIGINT, SIGTERM and, but on Windows, SIGHUP set. The former handlers are put back at the end.

    Python lets only the main thread hear signals; in another thread `also` alone stops it. SIGHUP comes when the
    terminal is closed. Output that is written to it from then on is lost, without an error. A process that was started
    to outlive its terminal, as by nohup, ignores it.

    Args:
        also: what stops it, too, such as a `threading.Event`.
    """
    stop = Stop(also)
    if not in_main_thread():
        yield stop
        return

    def handle(number: int, _frame: FrameType | None) -> None:
        if number not in (signal.SIGINT, signal.SIGTERM):
            _leave_terminal()
        if stop.interrupts and stop.is_set() and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.set(number)

    numbers = [signal.SIGINT, signal.SIGTERM]
    if POSIX and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if stop.signal is not None:
            log.info("stopped by %s", signal.Signals(stop.signal).name)


def _leave_terminal() -> None:
    """Let what is written to a terminal, or read from it, go nowhere."""
    for descriptor in (0, 1, 2):
        with contextlib.suppress(OSError):
            if stat.S_ISCHR(os.fstat(descriptor).st_mode):
                nothing = os.open(os.devnull, os.O_RDWR)
                os.dup2(nothing, descriptor)
                os.close(nothing)
