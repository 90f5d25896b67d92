"""Files that others may have made: read in bounds, and written without following links.

A run folder, a folder of strategies or a match file may come from another person or another machine, and a power cut
may have torn what VRG has written itself. So only regular files of bounded sizes are read: a pipe would be waited for
without end, and a file of many gigabytes would take all memory. In a file of records, whole records count, and torn
ones are named.
"""

import codecs
import io
import json
import logging
import os
import secrets
import stat
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from errno import EFBIG, EINVAL
from pathlib import Path
from typing import Any, BinaryIO, Generic, Protocol, TypeVar

import msgspec

from vrg.errors import FileError
from vrg.system import FILE_FLAGS, POSIX, UNWAITED_FLAGS
from vrg.types import printable

log = logging.getLogger(__name__)

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

TEXT_LIMIT = 4_000_000
"""The bytes that a file which people write may have, such as a match file."""
DATA_LIMIT = 64_000_000
"""The bytes that a file which VRG writes, and reads as a whole, may have."""
RECORDS_LIMIT = 300_000_000
"""The bytes that a file of records may have."""
_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFDIR: "a folder",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


class Decoder(Protocol[T_co]):
    """A decoder of msgspec, for JSON or MessagePack."""

    def decode(self, data: bytes, /) -> T_co:
        """Decode bytes."""


def opened(path: Path, most: int | None = None) -> BinaryIO:
    """Open a regular file for reading.

    Args:
        most: the bytes that it may have; None for any number.

    Raises:
        OSError: it cannot be opened, is no regular file, or has more bytes. Its `strerror` has the reason in words.
    """
    # Otherwise a pipe that nobody writes would be waited for.
    descriptor = os.open(path, os.O_RDONLY | UNWAITED_FLAGS | FILE_FLAGS)
    try:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            kind = _KINDS.get(stat.S_IFMT(found.st_mode), "something else")
            raise OSError(EINVAL, f"expected a regular file, found {kind}", str(path))
        if most is not None and found.st_size > most:
            text = f"expected at most {most / 1e6:g} MB, found {found.st_size / 1e6:.0f} MB"
            raise OSError(EFBIG, text, str(path))
        return open(descriptor, "rb")
    except OSError:
        os.close(descriptor)
        raise


def read_bytes(path: Path, most: int = DATA_LIMIT) -> bytes:
    """The content of a regular file.

    Raises:
        OSError: as `opened`.
    """
    with opened(path, most) as file:
        return file.read(most)


def read_text(path: Path, most: int = TEXT_LIMIT) -> str:
    """The text of a file that a person has written, with any ends of lines, and with or without a byte order mark.

    Editors of Windows save UTF-8 with such a mark, and PowerShell writes UTF-16.

    Raises:
        OSError: as `opened`. FileError: it is no text.
    """
    return text_of(read_bytes(path, most))


def text_of(data: bytes) -> str:
    """The text in the bytes of a file that a person has written; see `read_text`.

    Raises:
        FileError: they are no text.
    """
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        found = f"found the byte 0x{data[error.start]:02x} in line {line}" if not wide else "found half a character"
        raise FileError(f"expected a text in UTF-8, {found}: save it as UTF-8") from None
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise FileError(f"expected a text in UTF-8, found a zero byte in line {line}: save it as UTF-8")
    return io.StringIO(text, newline=None).read()


def read_json(path: Path, most: int = DATA_LIMIT) -> Any:
    """What a file of JSON holds.

    Raises:
        OSError: as `opened`. FileError: it is no JSON.
    """
    try:
        return json.loads(read_bytes(path, most))
    except (ValueError, RecursionError) as error:
        raise FileError(f"expected JSON: {_reason(error)}") from None


def toml_of(text: str) -> dict[str, Any]:
    """What a text in TOML holds.

    Raises:
        TOMLDecodeError: it is no TOML, or nested too deeply.
    """
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise tomllib.TOMLDecodeError(f"{_reason(error)} (at end of document)") from None


def decoded(decoder: Decoder[T], data: bytes) -> T:
    """What bytes of a file hold.

    Raises:
        FileError: they are not what the decoder reads.
    """
    try:
        return decoder.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FileError(_reason(error)) from None


def _reason(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    # It may name a field that anybody has written.
    return f"it is not in UTF-8: {error}" if isinstance(error, UnicodeDecodeError) else printable(str(error))


@dataclass(frozen=True)
class Records(Generic[T]):
    """What a file of records holds, one record of JSON a line.

    Attributes:
        whole: the records that could be read. damaged: the numbers of the other lines, from 1, and why.
        end: the number of bytes up to the end of the last record that could be read. torn: the bytes behind the last
            end of a line, which a process that was killed in the middle has left.
    """

    whole: list[T] = field(default_factory=list)
    damaged: list[tuple[int, str]] = field(default_factory=list)
    end: int = 0
    torn: int = 0

    def __iter__(self) -> Iterator[T]:
        return iter(self.whole)

    def damage(self, path: Path, what: str) -> list[str]:
        """What was left out, in sentences.

        Args:
            path: of the file. what: one of its records, with its article.
        """
        torn = [f"{path}: left out a torn last line of {self.torn} bytes"] if self.torn else []
        return [f"{path}:{number}: left out a line, expected {what}: {why}" for number, why in self.damaged] + torn

    def warn(self, path: Path, what: str) -> None:
        """Log what was left out, as `damage` words it."""
        for text in self.damage(path, what):
            log.warning("%s", text)


def records_of(content: bytes, *decoders: Decoder[T]) -> Records[T]:
    """The records in the content of a file.

    Args:
        decoders: those of the first lines, in their order; the last one is that of all further lines.
    """
    whole: list[T] = []
    damaged: list[tuple[int, str]] = []
    at = end = 0
    *lines, torn = content.split(b"\n")
    for number, line in enumerate(lines, 1):
        at += len(line) + 1
        try:
            whole.append(decoded(decoders[min(number, len(decoders)) - 1], line))
            end = at
        except FileError as error:
            damaged.append((number, str(error)))
    return Records(whole, damaged, end, len(torn))


def write_whole(path: Path, data: bytes, mode: int = 0o666, *, synced: bool = False) -> None:
    """Replace a file in one step, so that a reader sees either the old or the new content, never a part of it.

    A link in its place is replaced, too: what it leads to stays as it is.

    Args:
        mode: who may read and write it, less what the process' umask takes away.
        synced: return only when it is on the disk, where a power cut leaves it.

    Raises:
        OSError: it cannot be written; the old content is still there, unless only bringing its name to the disk failed.
    """
    # Another process may write the same file; and nobody can put a link there before.
    partial = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.partial")
    try:
        with open(os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL | FILE_FLAGS, mode), "wb") as file:
            file.write(data)
            if synced:
                file.flush()
                os.fsync(file.fileno())
        os.replace(partial, path)
        if synced:
            sync_folder(path.parent)
    except OSError:
        with suppress(OSError):
            partial.unlink()
        raise


def make_folder(path: Path, mode: int = 0o777) -> None:
    """Make a folder, and those above it that are missing; all of them are on the disk then.

    Args:
        mode: who may look into it, less what the process' umask takes away.

    Raises:
        OSError: it cannot be made.
    """
    if not path.is_dir():
        make_folder(path.parent)
        path.mkdir(mode, exist_ok=True)
        sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk; where a system cannot, it does so by itself, as Windows.

    Raises:
        OSError: it cannot be done.
    """
    if not POSIX:
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a JSON file for people and scripts.

    Raises:
        OSError: it cannot be written; the old content is still there.
    """
    write_whole(path, (json.dumps(content, indent=2) + "\n").encode())
