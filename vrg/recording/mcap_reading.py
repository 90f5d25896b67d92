"""Reads the records of recordings, in the order in which they were written.

A file that is torn, because its recorder was killed or its disk was full, is read as far as it goes.
"""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, TypeVar

import msgspec
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, McapRecord, Message
from mcap.stream_reader import StreamReader, breakup_chunk

from vrg.errors import FileError, MessageError
from vrg.files import decoded, opened
from vrg.recording.schemas import schema_name

R = TypeVar("R", bound=msgspec.Struct)

LONGEST: Final = 16_000_000
"""The bytes that a chunk may have, also unpacked. A recorder begins a new one after 1 MiB, and a picture may follow."""
_CUT: Final = (EndOfFile, struct.error)
"""The exceptions of mcap's reader where a file ends within a record."""
_DAMAGED: Final = (McapError, struct.error, zstandard.ZstdError, ValueError, LookupError, OverflowError, MemoryError)
"""Those where the bytes of a record are not such as it has."""


def records_in(
    path: Path | Sequence[Path], torn: list[Path] | None = None
) -> Iterator[tuple[str, dict[str, str], float, bytes]]:
    """Read every record of a recording that is whole.

    A chunk that is damaged is left out. What stands behind the last chunk whose end can be found is left out, too.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.
        torn: where to note the files that are torn or damaged.

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
    channels: dict[int, Channel] = {}
    whole = True
    with opened(path) as stream:
        records = StreamReader(stream, emit_chunks=True, record_size_limit=LONGEST).records
        begun = False
        while True:
            try:
                record = next(records, None)
            except _DAMAGED as error:
                if not begun and not isinstance(error, _CUT):
                    raise MessageError(f"{path}: expected an MCAP recording: {error}") from None
                whole = False
                break
            if record is None:
                break
            begun = True
            # A recorder writes messages into chunks only, which have a sum of their own.
            unpacked = _unpacked(record) if isinstance(record, Chunk) else []
            whole = whole and unpacked is not None
            for inner in unpacked or ():
                if isinstance(inner, Channel):
                    channels[inner.id] = inner
                elif isinstance(inner, Message) and (channel := channels.get(inner.channel_id)) is not None:
                    yield channel.topic, channel.metadata, inner.log_time / 1e9, inner.data
    if not whole and torn is not None:
        torn.append(path)


def _unpacked(chunk: Chunk) -> list[McapRecord] | None:
    """The records in a chunk; None if it is damaged."""
    size = chunk.uncompressed_size
    try:
        if chunk.compression == "zstd":
            size = max(size, zstandard.frame_content_size(chunk.data))
        elif chunk.compression:
            return None  # no recorder packs in another way
        return breakup_chunk(chunk, validate_crc=True) if size <= LONGEST else None
    except _DAMAGED:
        return None


def decode(data: bytes, record: type[R], topic: str) -> R:
    """Decode the JSON of one record.

    Raises:
        MessageError: it is not such a record.
    """
    try:
        return decoded(msgspec.json.Decoder(record), data)
    except FileError as error:
        raise MessageError(f"{topic}: expected {schema_name(record)}: {error}") from None
