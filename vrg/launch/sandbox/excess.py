"""What bounds of the process itself cannot hold for a sealed player: threads, sockets, and all that it has written."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import psutil

from vrg.launch.run_folder import RunFolder

THREADS = 300
"""The most threads of a sealed player. Zenoh and the Python interpreter have about twenty of them."""
SOCKETS = 32
"""The most sockets. It needs a few for the router, and an event loop has two."""
WRITTEN = 100_000_000
"""The most bytes that it may keep in its folder."""
ENTRIES = 10_000
"""The most files and folders there."""


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
    sockets, unlinked = _open(pid)
    if threads > THREADS or sockets > SOCKETS:
        return f"it has {threads} threads" if threads > THREADS else f"it has {sockets} sockets"
    try:
        size, count = _kept(folder)
    except PermissionError as error:
        return f"it has made a folder that nobody can look into: {error.filename}"
    size += unlinked + _mapped(pid)
    too_much = size > WRITTEN or count > ENTRIES
    return f"it keeps {size // 1_000_000} MB in {count} files in its folder" if too_much else None


def _kept(folder: Path) -> tuple[int, int]:
    """The room in bytes and the number of all files below a folder; what goes away meanwhile counts as nothing.

    Raises:
        PermissionError: a folder cannot be listed.
    """
    size = count = 0

    def refused(error: OSError) -> None:
        if isinstance(error, PermissionError):
            raise error

    for place, folders, names in os.walk(folder, onerror=refused):
        count += len(folders) + len(names)
        for entry in folders:
            # Who is root can list what its owner has closed, and must still be able to delete it as somebody else.
            if not os.lstat(os.path.join(place, entry)).st_mode & stat.S_IRUSR:
                raise PermissionError(0, "cannot be listed", os.path.join(place, entry))
        for name in names:
            try:
                size += _room(os.lstat(os.path.join(place, name)))
            except OSError:
                continue
        if count > ENTRIES:
            break
    return size, count


def _room(found: os.stat_result) -> int:
    """The room that a file takes on the disk, or will take when it is written back, bytes."""
    return max(found.st_size, found.st_blocks * 512)


def _open(pid: int) -> tuple[int, int]:
    """How many sockets a process has open, and the room of files that it has open and deleted, bytes."""
    sockets = unlinked = 0
    for found in _descriptors(pid):
        if stat.S_ISSOCK(found.st_mode):
            sockets += 1
        elif stat.S_ISREG(found.st_mode) and found.st_nlink == 0:
            unlinked += _room(found)
    return sockets, unlinked


def _descriptors(pid: int) -> Iterator[os.stat_result]:
    """What a process has open; nothing if it has ended."""
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
