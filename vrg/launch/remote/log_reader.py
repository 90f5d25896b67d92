"""Reads what processes add to their logs, so that it can be sent to the launcher."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from vrg.launch.remote.wire import PART, LogText

_BEHIND = 4 * PART
"""The number of bytes of one log that may wait; what is older is left out, and that is told."""


class LogReader:
    """See the module.

    Args:
        folder: the folder of the logs. read: how many bytes of each log were read before, by its name.
    """

    def __init__(self, folder: Path, read: Mapping[str, int]) -> None:
        self._folder = folder
        self._read = dict(read)

    def new_text(self) -> Iterator[LogText]:
        """What was added to each log since the last call, at most PART bytes of each."""
        for path in sorted(self._folder.glob("*.log")):
            try:
                size = path.stat().st_size
                # A log that has become too long begins anew.
                begin = self._read.get(path.stem, 0) if size >= self._read.get(path.stem, 0) else 0
                if size == begin:
                    continue
                note = b""
                if size - begin > _BEHIND:
                    note = f"\n[{size - PART - begin} bytes are left out here]\n".encode()
                    begin = size - PART
                with path.open("rb") as log:
                    log.seek(begin)
                    text = log.read(PART)
            except OSError:
                continue
            self._read[path.stem] = begin + len(text)
            yield LogText(path.stem, note + text, begin + len(text))
