"""What a strategy prints is bounded, so that nobody's endless output fills a disk."""

import io
import time
from collections.abc import Callable
from typing import Any, TextIO

from vrg.blame import OutputFloodError

FLOOD = 2_000_000
"""The number of characters that may be printed within WINDOW."""
WINDOW = 10.0
"""s"""


class BoundedOutput(io.TextIOBase):
    """A text stream that takes so much within a while, and then raises an exception in whoever writes.

    Args:
        stream: what is written goes there. now: returns the time, s.
    """

    def __init__(self, stream: TextIO, now: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._now = now
        self._since = now()
        self._count = 0

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """That of the stream below."""
        return self._stream.encoding

    def writable(self) -> bool:
        """It is."""
        return True

    def __getattr__(self, name: str) -> Any:
        """Everything else is as in the stream below."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text.

        Raises:
            OutputFloodError: too much was written.
        """
        if self._now() - self._since > WINDOW:
            self._since, self._count = self._now(), 0
        self._count += len(text)
        if self._count > FLOOD:
            raise OutputFloodError(f"it has printed more than {FLOOD // 1_000_000} MB within {WINDOW:g} s")
        return self._stream.write(text)

    def flush(self) -> None:
        """Write out what is buffered."""
        self._stream.flush()

    def fileno(self) -> int:
        """The descriptor of the stream below."""
        return self._stream.fileno()

    def isatty(self) -> bool:
        """Whether the stream below is a terminal."""
        return self._stream.isatty()
