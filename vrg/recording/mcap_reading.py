"""Reads the messages in recordings, in the order in which they were written.

A file that is torn, because its recorder was killed or its disk was full, is read as far as it goes.
"""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import mcap.records
import msgspec
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, McapRecord
from mcap.stream_reader import StreamReader, breakup_chunk

from vrg.bus.messages import Message
from vrg.bus.topics import Keys
from vrg.errors import FileError, MessageError
from vrg.files import decoded, opened
from vrg.recording.layout import VIEW
from vrg.recording.schemas import schema_name

MAX_CHUNK_SIZE: Final = 16_000_000
"""The bytes that a chunk may have, also unpacked. A recorder begins a new one after 1 MiB, and a picture may follow."""
_CUT: Final = (EndOfFile, struct.error)
"""The exceptions of mcap's reader where a file ends within a record."""
_DAMAGED: Final = (McapError, struct.error, zstandard.ZstdError, ValueError, LookupError, OverflowError, MemoryError)
"""Those where the bytes of a record are not such as it has."""


_KEYS = Keys("recorded")
"""The key map by which topics are recognised: they are the keys of a match below the part that names it."""
_EARLIER = ("/scene", "/map")
"""Topics that recordings of earlier releases have, and no other."""


def messages_in(path: Path | Sequence[Path], torn: list[Path] | None = None) -> Iterator[tuple[str, float, Message]]:
    """Read the messages of a recording that are whole; see `records_in`.

    Yields:
        the key of each below that of the match, such as `/robot/ann/pose`; its match time in s; and the message.

    Raises:
        OSError: a file cannot be read.
        MessageError: it is not a recording of this release, or one of its messages is no such message.
    """
    decoders: dict[str, msgspec.json.Decoder[Message] | None] = {}
    for topic, stamp, data in records_in(path, torn):
        if topic not in decoders:
            known = _KEYS.topic_of(f"{_KEYS.root}{topic}")
            decoders[topic] = None if known is None else msgspec.json.Decoder(known.type)
        decoder = decoders[topic]
        if decoder is not None:  # readings of sensors, whose kinds may not be installed here, are left out
            try:
                message = decoded(decoder, data)
            except FileError as error:
                raise MessageError(f"{topic}: expected {schema_name(decoder.type)}: {error}") from None
            yield topic, stamp, message


def records_in(path: Path | Sequence[Path], torn: list[Path] | None = None) -> Iterator[tuple[str, float, bytes]]:
    """Read the JSON of every message of a recording that is whole, without what only viewers read.

    A chunk that is damaged is left out. Data behind the last chunk whose end can be found is left out, too.

    Args:
        path: a recording, or its parts in their order where the recorder was started again.
        torn: where to note the files that are torn or damaged.

    Yields:
        the topic, the match time in s, and the JSON.

    Raises:
        OSError: a file cannot be read.
        MessageError: it is not an MCAP file, or one of an earlier release.
    """
    if not isinstance(path, Path):
        for part in path:
            yield from records_in(part, torn)
        return
    channels: dict[int, Channel] = {}
    whole = True
    with opened(path) as stream:
        records = StreamReader(stream, emit_chunks=True, record_size_limit=MAX_CHUNK_SIZE).records
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
            # The first chunk has all topics of an earlier release, before or behind messages that are as they are now.
            if any(isinstance(inner, Channel) and inner.topic in _EARLIER for inner in unpacked or ()):
                raise MessageError(
                    f"{path}: expected a recording of this release, got one of an earlier VRG: look at it with that, "
                    "or with Foxglove; `vrg run judge` needs the evidence alone"
                )
            for inner in unpacked or ():
                if isinstance(inner, Channel):
                    if not inner.topic.startswith(VIEW):
                        channels[inner.id] = inner
                elif isinstance(inner, mcap.records.Message) and (channel := channels.get(inner.channel_id)):
                    yield channel.topic, inner.log_time / 1e9, inner.data
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
        return breakup_chunk(chunk, validate_crc=True) if size <= MAX_CHUNK_SIZE else None
    except _DAMAGED:
        return None
