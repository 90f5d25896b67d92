"""The log of one process: what was written last, how much it is, and that it stays within bounds.

The process writes to it directly, so that its last words are there however it ends. What bounds it is outside.
"""

import re
from collections import deque
from pathlib import Path
from typing import IO

from vrg.blame import is_students, place_text
from vrg.types import printable

LOG_FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
"""The lines of what a process logs, as `logging` has it; `_WARNING` reads them."""
MAX_LOG_SIZE = 5_000_000
"""The size in bytes above which a log is moved to one with the ending `.1`, and starts again."""
FLOOD_SIZE = 20_000_000
"""The number of bytes within FLOOD_WINDOW that are too many for a player."""
FLOOD_WINDOW = 60.0
"""s"""
_FRAME = re.compile(r'^  File "(?P<file>[^"]+)", line (?P<line>\d+) in (?P<name>\S+)', re.MULTILINE)
_WARNING = re.compile(r"^\S+ \S+ (?:WARNING|ERROR) [\w.]+: (?P<text>.*)$", re.MULTILINE)
_TAIL = 20_000
"""The number of bytes at the end of a log in which last words are looked for."""


class ProcessLog:
    """The log of one process.

    Args:
        path: the file.

    Attributes:
        emptied: True once it was found shorter than before, although `grow` had not begun it again: its process did it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.emptied = False
        self._size = 0
        self._written: deque[tuple[float, int]] = deque()

    def open(self) -> IO[bytes]:
        """The file, to append to."""
        return self.path.open("ab")

    def last_words(self, lines: int) -> str:
        """The last lines, printable."""
        return printable("\n".join(self._tail().splitlines()[-lines:]), lines=True)

    @property
    def size(self) -> int:
        """Its size in bytes."""
        try:
            return self.path.stat().st_size
        except OSError:
            return 0

    def place(self, since: int) -> str:
        """The place of the student's code by the last dump of `faulthandler`, such as `ann.py, line 7, in act`.

        Empty if there is no dump, or none of its frames is a student's.

        Args:
            since: the size of the log before the dump was asked for, bytes.
        """
        dump = self._tail(since).rpartition("(most recent call first):")
        frames = [m for m in _FRAME.finditer(dump[2]) if is_students(m["file"])] if dump[1] else []
        return place_text(frames[0]["file"], frames[0]["line"], frames[0]["name"]) if frames else ""

    def grow(self, now: float) -> int:
        """Look how much was written within FLOOD_WINDOW, bytes, and begin the file again if it is too long.

        Args:
            now: the monotonic time, s.
        """
        size = self.size
        self.emptied = self.emptied or (size < self._size and self.path.exists())
        written = self._written  # another thread may forget it meanwhile
        written.append((now, max(0, size - self._size)))
        while now - written[0][0] > FLOOD_WINDOW:
            written.popleft()
        self._size = size
        if size > MAX_LOG_SIZE:
            self._begin_anew()
        return sum(count for _, count in written)

    def forget(self) -> None:
        """Count what is written from now on."""
        self._size = self.size
        self._written = deque()
        self.emptied = False

    def _begin_anew(self) -> None:
        # The process has the file open, so its content is moved and not the file. A line in between may be lost.
        try:
            with self.path.open("rb") as old, self.path.with_name(f"{self.path.name}.1").open("wb") as kept:
                old.seek(-MAX_LOG_SIZE, 2)
                # Not to its end: the process may write on while it is read.
                kept.write(old.read(MAX_LOG_SIZE))
            with self.path.open("r+b") as log:
                log.truncate(0)
        except OSError:
            return  # a full disk, or a file that is gone: there is nothing to bound
        self._size = 0

    def _tail(self, since: int = 0) -> str:
        try:
            with self.path.open("rb") as log:
                log.seek(max(since, self.size - _TAIL))
                return log.read().decode(errors="replace")
        except OSError:
            return ""


class LogWarnings:
    """The warnings in the log of a process, as they come.

    Args:
        path: the log.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._read = path, 0

    def new(self) -> list[str]:
        """The texts of the warnings since the last call, in whole lines; none if the log cannot be read."""
        try:
            size = self._path.stat().st_size
            if size == self._read:
                return []
            with self._path.open("rb") as log:
                log.seek(self._read if size > self._read else 0)
                text, end, rest = log.read(_TAIL).rpartition(b"\n")
                self._read = log.tell() - len(rest)
        except OSError:
            return []
        return [match["text"] for match in _WARNING.finditer((text + end).decode(errors="replace"))]
