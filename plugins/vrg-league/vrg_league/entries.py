"""The entries of a league or a tournament: what its authors have put into the folder, as bytes.

A file of a strategy is an entry, and so is a folder of files, with the helpers and weights of its strategy. It plays
from a copy that has these files alone, so that it cannot import what others have written. Authors may put anything
there at any time: pipes, links to the files of others, files without an end. So nothing is read through a link, nothing
but regular files, no more than LARGEST bytes, and nothing is run.
"""

import hashlib
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Final

from msgspec import Struct, structs

from vrg.errors import ConfigError
from vrg.games import is_strategy_file
from vrg.names import normal
from vrg.system import FILE_FLAGS, POSIX, UNWAITED_FLAGS
from vrg.types import printable

LARGEST: Final = 4_000_000
"""The number of bytes that the files of an entry may have together."""
PATH_SIZE: Final = 200
"""The number of bytes that the path of a file may have in the folder of its entry."""
ENTRY_SIZE: Final = 200_000_000
"""The number of bytes that all entries may have together."""
MAX_FILES: Final = 100
"""The number of files and folders that an entry may have."""
_LABEL_SIZE: Final = 60
"""The number of bytes of a label. The name of a file has two, and may have 255."""


class Source(Struct, frozen=True, kw_only=True):
    """An entry as it was found.

    Args:
        entry: the name of the entry. name: that of its file or folder.
        files: the content of each file by its path in the folder of a version. main: the file of the strategy there.
        problem: why it cannot be read, in words; empty if it was.
    """

    entry: str
    name: str
    files: dict[str, bytes] = {}
    main: str = ""
    problem: str = ""

    @property
    def digest(self) -> str:
        """The SHA-256 of its content: what `sha256sum` prints if it is a single file; empty if it cannot be read."""
        if not self.files:
            return ""
        if list(self.files) == [self.main]:
            return hashlib.sha256(self.files[self.main]).hexdigest()
        parts = (f"{name}\0{hashlib.sha256(data).hexdigest()}\n" for name, data in sorted(self.files.items()))
        return hashlib.sha256("".join(parts).encode("utf-8", "surrogateescape")).hexdigest()

    def write(self, folder: Path) -> Path:
        """Write its files into a folder, and return that of its strategy there.

        Raises:
            OSError: they cannot be written.
        """
        for name, data in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        return folder / self.main


def entries_in(folder: Path, *, without: tuple[Path, ...] = (), owner: Callable[[str], str]) -> list[Source]:
    """The entries in a folder, sorted by name. What begins with `.` or `_` is none, nor is a folder without strategy.

    Args:
        without: folders that are no entries. owner: the file that has a name already, by the name; empty if none has.

    Raises:
        ConfigError: the folder cannot be read.
    """
    others = {path.resolve() for path in without}
    found: dict[str, Source] = {}
    left = ENTRY_SIZE
    for path in entry_paths(folder):
        if folder.resolve() / path.name in others or (source := read_entry(path)) is None:
            continue
        size = sum(map(len, source.files.values()))
        if size > left:
            problem = f"it is too much: all entries together may have {ENTRY_SIZE / 1e6:g} MB"
            source, size = structs.replace(source, files={}, main="", problem=problem), 0
        left -= size
        first = found.get(source.entry)
        if first is not None and owner(source.entry) == source.name:
            first, source = source, first
        if first is not None:
            problem = f"{first.name} is the entry {first.entry} already: give it another name"
            label = short(f"{source.entry}-{source.name}")
            source = Source(entry=label, name=source.name, problem=problem)
            found[first.entry] = first
        found.setdefault(source.entry, source)
    return sorted(found.values(), key=lambda source: source.entry)


def entry_paths(folder: Path) -> list[Path]:
    """The paths in a folder that may be entries, sorted.

    Raises:
        ConfigError: the folder cannot be read.
    """
    try:
        return [folder / name for name in sorted(os.listdir(folder)) if name[:1] not in "._"]
    except OSError as error:
        raise ConfigError(f"{folder}: expected a folder of strategies: {error.strerror}") from None


def read_entry(path: Path) -> Source | None:
    """An entry as it is now; None if it is no file of a strategy and no folder with one."""
    own = _is_strategy(path.name)
    stem = path.stem if own else path.name
    source = Source(entry=short(stem), name=printable(path.name))
    try:
        path.name.encode()
        if own:
            main = f"{source.entry}{path.suffix}"
            return structs.replace(source, files={main: _read(path.name, LARGEST, path.parent)}, main=main)
        return _read_folder(path, source) if stat.S_ISDIR(path.lstat().st_mode) else None
    except UnicodeEncodeError:
        problem = "its name is not in UTF-8: give it another one"
        return Source(entry=short(ascii(stem)), name=ascii(path.name), problem=problem) if own else None
    except (OSError, RecursionError) as error:
        return structs.replace(source, problem=f"{source.name}: cannot be read: {error}")
    except ConfigError as error:
        return structs.replace(source, problem=str(error))


def _read_folder(path: Path, source: Source) -> Source | None:
    """An entry that is a folder: its strategy is its only file of one, or that with the name of the folder.

    Raises:
        OSError, ConfigError: it cannot be read.
    """
    files, left, seen = dict[str, bytes](), LARGEST, 0
    mains = [name for name in sorted(os.listdir(path)) if _is_strategy(name) and name[:1] not in "._"]
    if not mains:
        return None
    named = [name for name in mains if Path(name).stem == path.name] or mains
    if len(named) != 1 or short(Path(named[0]).stem) != Path(named[0]).stem:
        found = printable(", ".join(mains))
        raise ConfigError(
            f"{source.name}: expected the strategy in {source.entry}.py, or in the only file, found {found}"
        )
    for place, folders, names, *handle in os.fwalk(path) if POSIX else os.walk(path):
        folders[:] = sorted(name for name in folders if name[:1] != "." and name != "__pycache__")
        seen += len(folders) + len(names)
        if seen > MAX_FILES:
            raise ConfigError(f"{source.name}: expected at most {MAX_FILES} files and folders in it, found more")
        for name in sorted(name for name in names if name[:1] != "."):
            own = os.path.relpath(os.path.join(place, name), path)
            if len(os.fsencode(own)) > PATH_SIZE:
                raise ConfigError(
                    f"{source.name}: expected paths of at most {PATH_SIZE} bytes in it, found a longer one"
                )
            data = _read(name, left, handle[0] if handle else Path(place))
            left -= len(data)
            files[own] = data
    return structs.replace(source, files=files, main=named[0])


def _is_strategy(name: str) -> bool:
    return name.endswith(".py") or is_strategy_file(name)


def _read(name: str, most: int, folder: Path | int) -> bytes:
    """The content of a regular file that is no link.

    Args:
        folder: its folder, as a path or an open descriptor.

    Raises:
        OSError: it cannot be read. ConfigError: it is no such file, or has more than `most` bytes.
    """
    handle = folder if isinstance(folder, int) else None
    path = name if isinstance(folder, int) else str(folder / name)
    kind = os.lstat(path, dir_fd=handle).st_mode
    if not stat.S_ISREG(kind):
        what = "a link" if stat.S_ISLNK(kind) else "none"
        raise ConfigError(f"{printable(name)}: expected a file, found {what}: put the file itself there")
    # Another thing may have taken the place of the file just now; a pipe would be waited for.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | UNWAITED_FLAGS | FILE_FLAGS, dir_fd=handle)
    with open(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise ConfigError(f"{printable(name)}: expected a file, and it was replaced by something else just now")
        data = file.read(most + 1)
    if len(data) > most:
        raise ConfigError(f"{printable(name)}: expected at most {LARGEST / 1e6:g} MB for all files of an entry")
    return data


def short(name: str) -> str:
    """A name with only such signs as may stand in the name of a file, and not too long for one."""
    words = "".join(sign if sign.isalnum() or sign in "-_ " else "-" for sign in " ".join(normal(name).split()))
    return words.encode()[:_LABEL_SIZE].decode(errors="ignore").strip() or "strategy"
