"""Reads the records of recordings, in the order in which they were written.

A file that is torn, because its recorder was killed or its disk was full, is read as far as it goes.
"""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, TypeVar

import msgspec
from mcap.exceptions import EndOfFile, InvalidMagic, McapError
from mcap.reader import NonSeekingReader
from zstandard import ZstdError

from vrg.errors import MessageError
from vrg.recording.schemas import schema_name

R = TypeVar("R", bound=msgspec.Struct)

_TORN: Final = (EndOfFile, struct.error, ZstdError)
"""The exceptions of mcap's reader where a file ends within a record."""


def records_in(
    path: Path | Sequence[Path], torn: list[Path] | None = None
) -> Iterator[tuple[str, dict[str, str], float, bytes]]:
    """Read every record of a recording, up to where it is torn.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.
        torn: where to note the files that are torn.

    Yields:
        the topic, the channel's metadata, the match time in s, and the JSON of the record.

    Raises:
        OSError: a file cannot be read.
        MessageError: it is not an MCAP file.
    """
    if not isinstance(path, Path):
        for part in path:
            yield from records_in(part, torn)
        return
    with path.open("rb") as stream:
        try:
            for _, channel, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
                yield channel.topic, channel.metadata, message.log_time / 1e9, message.data
        except _TORN:
            if torn is not None:
                torn.append(path)
        except (InvalidMagic, McapError) as error:
            raise MessageError(f"{path}: expected an MCAP recording: {error}") from None


def decode(data: bytes, record: type[R], topic: str) -> R:
    """Decode the JSON of one record.

    Raises:
        MessageError: it is not such a record.
    """
    try:
        return msgspec.json.decode(data, type=record)
    except msgspec.DecodeError as error:
        raise MessageError(f"{topic}: expected {schema_name(record)}: {error}") from None
