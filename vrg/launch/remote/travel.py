"""Files of a run folder that travel to another machine and back, and logs that travel while they grow."""

import errno
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path, PurePosixPath

from vrg.errors import LaunchError
from vrg.launch.remote.wire import PART, FilePart, LogText

_BEHIND = 4 * PART
"""The number of bytes of one log that may wait; what is older is left out, with a note."""


def files_in(
    folder: Path, leave_out: Collection[str] = (), failed: Callable[[str, OSError], None] | None = None
) -> list[str]:
    """The files below a folder that travel, as paths in it with `/` between their parts.

    Links do not, nor what Python and VRG make for themselves: folders `__pycache__`, and names that begin with a dot.

    Args:
        leave_out: further files that do not.
        failed: called for each file whose name cannot be sent to another machine.
    """
    found = []
    paths: list[Path] = []
    # A path that is too long for the system is left out: a process may make folders within folders without end.
    for place, _, names in os.walk(folder):
        paths += (Path(place, name) for name in names)
    for path in sorted(paths):
        name = path.relative_to(folder)
        own = any(part.startswith(".") or part == "__pycache__" for part in name.parts)
        if not path.is_file() or path.is_symlink() or own or name.as_posix() in leave_out:
            continue
        try:
            name.as_posix().encode()
        except UnicodeEncodeError:
            if failed is not None:
                failed(ascii(name.as_posix()), OSError(errno.EILSEQ, "its name is not UTF-8"))
            continue
        found.append(name.as_posix())
    return found


def parts_of(
    folder: Path, leave_out: Collection[str] = (), failed: Callable[[str, OSError], None] | None = None
) -> Iterator[FilePart]:
    """Every file below a folder that travels, in parts.

    Args:
        leave_out: files that do not travel; see `files_in`.
        failed: called with the name of each file that cannot be read, and why; the others still come.

    Raises:
        OSError: a file cannot be read, and there is no `failed`.
    """
    for name in files_in(folder, leave_out, failed):
        try:
            yield from file_parts(folder / name, name)
        except OSError as error:
            if failed is None:
                raise
            failed(name, error)


def file_parts(path: Path, name: str) -> Iterator[FilePart]:
    """A file, in parts, as the file of this name in a run folder.

    Raises:
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        begins = True
        while data := file.read(PART):
            yield FilePart(name, data, begins)
            begins = False
        if begins:
            yield FilePart(name, b"", begins)


def take_in(folder: Path, part: FilePart) -> None:
    """Write a part of a file into a folder.

    Raises:
        LaunchError: its path leads out of the folder.
        OSError: it cannot be written.
    """
    place = PurePosixPath(part.path)
    target = folder / place
    strange = place.is_absolute() or ".." in place.parts or not place.name or "\0" in part.path
    if strange or not target.parent.resolve().is_relative_to(folder.resolve()) or target.is_symlink():
        raise LaunchError(f"expected a file of the run folder, got {part.path!r}")
    target.parent.mkdir(parents=True, exist_ok=True)
    with target.open("wb" if part.begins else "ab") as file:
        file.write(part.data)


class LogReader:
    """Reads what processes add to their logs.

    Args:
        folder: the folder of the logs. read: how many bytes of each log were read before, by its name.
    """

    def __init__(self, folder: Path, read: Mapping[str, int]) -> None:
        self._folder = folder
        self._read = dict(read)

    def new_text(self) -> Iterator[LogText]:
        """The text that was added to each log since the last call, at most PART bytes of each."""
        for path in sorted(self._folder.glob("*.log")):
            try:
                size = path.stat().st_size
                # A log that has become too long starts again.
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
