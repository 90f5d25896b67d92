"""Bounds for code that a student has written: memory and output."""

import contextlib
import faulthandler
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

import psutil

from vrg.blame import OutputFloodError
from vrg.system import POSIX

if POSIX:
    import resource

OUTPUT_LIMIT = 2_000_000
"""The number of characters that may be printed within OUTPUT_WINDOW."""
OUTPUT_WINDOW = 10.0
"""s"""


@contextmanager
def bounded_memory(megabytes: int) -> Iterator[None]:
    """Let this process get this much more memory than it has, and not more; a request for more raises a MemoryError.

    macOS accepts the bound and does not keep it; on Windows there is none.
    """
    if not POSIX:
        yield
        return
    before = _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = getattr(psutil.Process().memory_info(), "data", 0) + megabytes * 1_000_000
    resource.setrlimit(resource.RLIMIT_DATA, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


class BoundedOutput:
    """A text stream that takes so much within a while, and then raises an exception where it is written to.

    Args:
        stream: what is written goes there, and it does everything else. now: returns the time, s.
    """

    def __init__(self, stream: TextIO, now: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._now = now
        self._since = now()
        self._count = 0

    def __getattr__(self, name: str) -> Any:
        """Everything else is as in the stream below."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text.

        Raises:
            OutputFloodError: too much was written.
        """
        if self._now() - self._since > OUTPUT_WINDOW:
            self._since, self._count = self._now(), 0
        self._count += len(text)
        if self._count > OUTPUT_LIMIT:
            raise OutputFloodError(
                f"it has printed more than {OUTPUT_LIMIT // 1_000_000} MB within {OUTPUT_WINDOW:g} s"
            )
        return self._stream.write(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write some texts; see `write`."""
        for line in lines:
            self.write(line)


@contextmanager
def printing_to(stream: BoundedOutput) -> Iterator[None]:
    """Let what is printed go to a stream."""
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
        yield


def say_where_on_request() -> None:
    """Let this process write to its log where it is when it gets SIGUSR1, even in an endless loop, or crashes."""
    faulthandler.enable()
    if POSIX:
        faulthandler.register(signal.SIGUSR1)
