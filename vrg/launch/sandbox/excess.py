"""Limits of a sealed player that bounds of the process itself cannot hold: threads, sockets, and its files."""

import contextlib
import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

import psutil

from vrg.runs.run_folder import RunFolder
from vrg.types import printable

THREADS = 300
"""The most threads of a sealed player. Zenoh and the Python interpreter have about twenty of them."""
SOCKETS = 32
"""The most sockets. It needs a few for the router, and an event loop has two."""
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
    if not folder.is_dir():
        return None
    try:
        threads = psutil.Process(pid).num_threads()
    except psutil.Error:
        return None
    return None if (why := _excess(folder, pid, threads)) is None else printable(why)


def _excess(folder: Path, pid: int, threads: int) -> str | None:
    sockets, unlinked = _open(pid)
    if threads > THREADS or sockets > SOCKETS:
        return f"it has {threads} threads" if threads > THREADS else f"it has {sockets} sockets"
    size, count, why = _kept(folder)
    size += unlinked + _mapped(pid)
    if why is None and (size > MAX_FOLDER_SIZE or count > ENTRIES):
        why = f"it keeps {size // 1_000_000} MB in {count} files in its folder"
    return why


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
                    # Who is root can list what its owner has closed, and must still be able to delete it.
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
            return size, count, f"its folder cannot be looked through: {problem.strerror}"
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
    try:
        names = os.listdir(f"/proc/{pid}/fd")
    except OSError:
        return
    for name in names:
        try:
            yield os.stat(f"/proc/{pid}/fd/{name}")
        except OSError:
            continue


def _mapped(pid: int) -> int:
    """The size of deleted files that a process has mapped, bytes: they stay on the disk without a descriptor."""
    try:
        lines = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return 0
    size = 0
    for line in lines:
        if line.endswith("(deleted)") and " 00:00 " not in line:
            begin, _, end = line.split(" ", 1)[0].partition("-")
            size += int(end, 16) - int(begin, 16)
    return size
