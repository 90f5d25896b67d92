"""The policy of a sealed process: the files and ports that it may reach, as data."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from pathlib import Path


class Access(Flag):
    """The ways in which a file, or everything in a folder, may be used.

    LIST names the files of a folder, READ reads and runs code, WRITE changes files that are there, and MAKE makes and
    removes files too.
    """

    LIST = auto()
    READ = auto()
    WRITE = auto()
    MAKE = auto()


@dataclass(frozen=True, kw_only=True)
class SealPolicy:
    """The files and ports that a sealed process may reach.

    Args:
        files: files and folders, and what may be done there. Nothing else can be read or written.
        folder: the folder of its own, where it may write.
        memory: the most memory that the strategy may use, MB.
        core: chooses the one processor core that it runs on, by the player's number in the match. With it, the process
            steps back behind the others.
        ports: the TCP ports that may be connected to.
    """

    files: tuple[tuple[Path, Access], ...]
    folder: Path
    memory: int
    core: int | None
    ports: tuple[int, ...] = ()


SYSTEM = (
    *(Path(name) for name in ("/usr", "/lib", "/lib32", "/lib64", "/bin")),
    *(Path("/proc", name) for name in ("stat", "meminfo", "cpuinfo", "version", "filesystems")),
    # Not its environment, and not what is mounted.
    *(Path("/proc/self", name) for name in ("stat", "statm", "status", "maps", "cmdline", "comm", "limits")),
    *(Path("/etc", name) for name in ("ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "timezone")),
    *(Path("/etc", name) for name in ("hosts", "host.conf", "nsswitch.conf", "gai.conf", "resolv.conf", "services")),
    *(Path("/etc", name) for name in ("passwd", "group", "mime.types", "alternatives", "fonts", "ssl/openssl.cnf")),
    *(Path("/sys/devices/system", name) for name in ("cpu", "node")),
)
"""The parts of the system that a sealed process may read. `/proc/self` is its own."""
DEVICES = tuple(Path("/dev", name) for name in ("null", "full", "random", "urandom"))
"""The devices that it may read and write. Memory could be taken from `/dev/zero` that no bound counts."""


def readable(root: Path, hidden: Collection[Path], entries: Callable[[Path], Iterable[Path]]) -> Iterator[Path]:
    """The parts of a folder that may be read if some of it is hidden: as few folders and files as possible.

    Args:
        root: the folder or file. hidden: what may not be read, as absolute paths without links.
        entries: the files and folders in a folder, as absolute paths.
    """
    place = root.resolve()
    if any(place.is_relative_to(secret) for secret in hidden):
        return
    if any(secret.is_relative_to(place) for secret in hidden):
        for entry in entries(root):
            yield from readable(entry, hidden, entries)
    else:
        yield root


def files(
    *,
    own: Sequence[Path],
    libraries: Sequence[Path],
    hidden: Collection[Path],
    folder: Path,
    entries: Callable[[Path], Iterable[Path]],
    listed: Collection[Path] = (),
) -> tuple[tuple[Path, Access], ...]:
    """The access of a player to files.

    Args:
        own: its strategy, and the files and packages that it needs. libraries: the folders of Python and its packages.
        hidden: what is in these folders and not for its eyes. One with a library in it is readable anyway.
        folder: its own folder.
        entries: as for `readable`. listed: the folders in which Python looks for its modules.
    """
    found = [(path, Access.READ) for path in SYSTEM]
    found += [(Path("/proc/self", name), Access.LIST) for name in ("fd", "task")]
    found += [(path, Access.READ | Access.WRITE) for path in DEVICES]
    found += [(path, Access.LIST) for path in (*libraries, *listed)]
    secret = [path for path in hidden if not any(library.is_relative_to(path) for library in libraries)]
    found += [(path, Access.READ) for root in libraries for path in readable(root, secret, entries)]
    found += [(path, Access.READ) for path in own]
    found += [(folder, Access.READ | Access.WRITE | Access.MAKE)]
    return tuple(dict.fromkeys(found))
