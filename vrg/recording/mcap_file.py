"""An MCAP file of JSON messages that is being written."""

from pathlib import Path
from typing import BinaryIO, Final

import msgspec
from mcap.writer import Writer
from msgspec import Struct

from vrg.bus.codec import SEQUENCES
from vrg.errors import MessageError
from vrg.recording.schemas import json_schema, schema_name

CHUNK_BYTES: Final = 1 << 20
"""A second of a match with lasers may be larger than this; it is then cut in two."""
_CHANNELS: Final = 2**16 - 1
"""The number of topics that a file may have."""


class McapFile:
    """Writes messages; a topic and its schema are written to the file when the first message of it is written.

    Flushed data can be read even if nothing else is ever written.

    Args:
        output: the file to make; where one of that name exists, a number is added, so that no file is ever overwritten.
            Or an open binary file, which is not closed.

    Attributes:
        path: the file that was made, or None for an open one.

    Raises:
        OSError: the file cannot be made, or there is no room for its first bytes. The other methods raise it too.
    """

    def __init__(self, output: Path | BinaryIO) -> None:
        self.path: Path | None = None
        self._closes = isinstance(output, Path)
        if isinstance(output, Path):
            self.path, self._stream = _open_new(output)
        else:
            self._stream = output
        self._encode = msgspec.json.Encoder().encode
        self._schemas: dict[type[Struct], int] = {}
        self._channels: dict[str, int] = {}
        self._writer = Writer(self._stream, chunk_size=CHUNK_BYTES)
        try:
            self._writer.start(profile="", library="vrg")
            self._stream.flush()
        except OSError:
            self.abandon()
            raise

    def write(self, topic: str, record: Struct, stamp: float, sequence: int) -> None:
        """Add a message.

        Args:
            stamp: match time, s. sequence: the publisher's.

        Raises:
            MessageError: MCAP cannot hold it, so that nothing of it was written.
        """
        # The writer checks nothing: it would fail in the middle of a record, and spoil those around it.
        time = round(stamp * 1e9)
        if not (0 <= time < 2**64 and 0 <= sequence < SEQUENCES):
            text = f"a number from 0 to {SEQUENCES - 1} and a stamp from 0 s, got {sequence} and {stamp:g} s"
            raise MessageError(f"{topic}: expected {text}")
        try:
            data = self._encode(record)
        except (ValueError, TypeError) as error:
            raise MessageError(f"{topic}: expected what can be written as JSON: {error}") from None
        channel = self._channels.get(topic)
        if channel is None:
            if len(self._channels) >= _CHANNELS:
                raise MessageError(f"{topic}: expected at most {_CHANNELS} topics, got one more")
            kind = type(record)
            if kind not in self._schemas:
                schema = self._writer.register_schema(schema_name(kind), "jsonschema", json_schema(kind))
                self._schemas[kind] = schema
            channel = self._writer.register_channel(topic, "json", self._schemas[kind])
            self._channels[topic] = channel
        self._writer.add_message(channel, time, data, time, sequence)

    def flush(self) -> None:
        """Hand everything that was written to the operating system, so that it outlives this process."""
        self._writer.flush()  # type: ignore[no-untyped-call]

    def finish(self) -> None:
        """Write the index and close the file. Nothing can be written afterwards."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        if self._closes:
            self._stream.close()

    def abandon(self) -> None:
        """Close the file as it is, after an error. This raises nothing."""
        if not self._closes:
            return
        try:
            self._stream.close()
        except OSError:
            # Closing tries to write the rest once more, and it fails for the reason that is already known.
            return


def _open_new(path: Path) -> tuple[Path, BinaryIO]:
    number = 1
    while True:
        candidate = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        try:
            return candidate, candidate.open("xb")
        except FileExistsError:
            number += 1
