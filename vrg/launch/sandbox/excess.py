"""Limits of a sealed strategy that bounds of the process itself cannot hold: threads, sockets, and its files."""

import contextlib
import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from vrg.runs.run_folder import RunFolder
from vrg.types import printable

THREADS = 300
"""The most threads of a sealed process."""
SOCKETS = 32
"""The most sockets. It has one, and an event loop two."""
MAX_FOLDER_SIZE = 100_000_000
"""The most bytes that it may keep in its folder."""
ENTRIES = 10_000
"""The most files and folders there."""
MAX_FOLDER_DEPTH = 50
"""The most folders within one another there."""


def excess(run: Path, name: str, pid: int) -> str | None:
    """Why a player uses too much, in words; None if it does not, or if it has no folder because it is not sealed.

    Args:
        run: the run folder. name: of the player. pid: its process.
    """
    folder = RunFolder(run).of_player(name)
    # Counted, and not read: in its status the name comes first that a process gives itself.
    threads = len(_names(pid, "task")) if folder.is_dir() else 0
    if not threads:
        return None
    sockets, unlinked = _open(pid)
    if threads > THREADS or sockets > SOCKETS:
        return f"it has {threads} threads" if threads > THREADS else f"it has {sockets} sockets"
    size, count, why = _kept(folder)
    size += unlinked + _mapped(pid)
    if why is None and (size > MAX_FOLDER_SIZE or count > ENTRIES):
        why = f"it keeps {size // 1_000_000} MB in {count} files in its folder"
    return None if why is None else printable(why)


def proc_text(pid: int, name: str) -> str:
    """The text of a file of the kernel about a process; empty if that has ended, or where there is no such file."""
    try:
        return Path(f"/proc/{pid}/{name}").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _names(pid: int, folder: str) -> list[str]:
    """The names in a folder of the kernel about a process; none if that has ended."""
    try:
        return os.listdir(f"/proc/{pid}/{folder}")
    except OSError:
        return []


def _kept(folder: Path) -> tuple[int, int, str | None]:
    """The room in bytes and the number of all files below a folder, and what keeps it from being looked through.

    What goes away meanwhile counts as nothing.
    """
    size = count = 0
    refused: list[OSError] = []
    try:
        # By descriptors, as a path of many folders may be longer than the system takes.
        for place, folders, names, here in os.fwalk(folder, onerror=refused.append):
            count += len(folders) + len(names)
            for name in (*folders, *names):
                with contextlib.suppress(FileNotFoundError):
                    found = os.stat(name, dir_fd=here, follow_symlinks=False)
                    if not stat.S_ISDIR(found.st_mode):
                        size += _room(found)
                    # Root can list a folder that its owner has closed, and must still be able to delete it.
                    elif not found.st_mode & stat.S_IRUSR:
                        refused.append(PermissionError(errno.EACCES, "", name))
            if place.count(os.sep) > folder.as_posix().count("/") + MAX_FOLDER_DEPTH:
                return size, count, f"it nests more than {MAX_FOLDER_DEPTH} folders"
            if count > ENTRIES:
                break
    except OSError as error:
        refused.append(error)
    for problem in refused:
        if isinstance(problem, PermissionError):
            return size, count, f"it has made a folder that cannot be listed: {problem.filename}"
        if not isinstance(problem, FileNotFoundError | NotADirectoryError):
            return size, count, f"its folder cannot be searched: {problem.strerror}"
    return size, count, None


def _room(found: os.stat_result) -> int:
    """The room that a file takes on the disk, or will take when it is written back, bytes."""
    return max(found.st_size, found.st_blocks * 512)


def _open(pid: int) -> tuple[int, int]:
    """The number of sockets that a process has open, and the size of files that it has open and deleted, bytes."""
    sockets = unlinked = 0
    for found in _descriptors(pid):
        if stat.S_ISSOCK(found.st_mode):
            sockets += 1
        elif stat.S_ISREG(found.st_mode) and found.st_nlink == 0:
            unlinked += _room(found)
    return sockets, unlinked


def _descriptors(pid: int) -> Iterator[os.stat_result]:
    """The open files of a process; none if it has ended."""
    for name in _names(pid, "fd"):
        with contextlib.suppress(OSError):
            yield os.stat(f"/proc/{pid}/fd/{name}")


def _mapped(pid: int) -> int:
    """The size of deleted files that a process has mapped, bytes: they stay on the disk without a descriptor."""
    size = 0
    for line in proc_text(pid, "maps").splitlines():
        if line.endswith("(deleted)") and " 00:00 " not in line:
            begin, _, end = line.split(" ", 1)[0].partition("-")
            size += int(end, 16) - int(begin, 16)
    return size
