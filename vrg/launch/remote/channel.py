"""A connection between the launcher and an agent, over two pipes. Using it never waits for the other side."""

import contextlib
import os
import select
from collections import deque
from typing import Generic, TypeVar

from msgspec import Struct

from vrg.launch.remote.wire import Frames, frame

M = TypeVar("M")

_CHUNK = 1 << 16
MAX_BATCH = 64
"""The number of messages and chunks that one call takes in at most: a machine that sends without end must not keep it
from others."""


class Channel(Generic[M]):
    """A connection between the launcher and an agent, over two pipes.

    Args:
        reader, writer: the descriptors to read from and to write to. They are made non-blocking.
        frames: cuts what is read into messages.

    Attributes:
        closed: True if the other side has closed the connection, or nothing can be written any more.
        received: the number of bytes that have arrived. backlog: the number of bytes that wait to be written.
    """

    def __init__(self, reader: int, writer: int, frames: Frames[M]) -> None:
        self._reader, self._writer = reader, writer
        self.frames = frames
        self._waiting: deque[memoryview] = deque()
        self.backlog = self.received = 0
        self.closed = False
        for descriptor in (reader, writer):
            os.set_blocking(descriptor, False)

    def send(self, message: Struct) -> None:
        """Write a message, as much of it as can be written now; the rest is written by `pump`."""
        self.send_bytes(frame(message))

    def send_bytes(self, data: bytes) -> None:
        """Write bytes that are no message, such as a banner."""
        self._waiting.append(memoryview(data))
        self.backlog += len(data)
        self._write()

    def pump(self, patience: float = 0.0) -> list[M]:
        """Write what waits, and return messages that have arrived.

        Args:
            patience: the longest real time in s to wait for something to read or for room to write.

        Raises:
            MessageError: what has arrived are no messages of this release.
        """
        if not self.closed:
            select.select([self._reader], [self._writer] if self._waiting else [], [], patience)
            self._write()
        found: list[M] = []
        for _ in range(MAX_BATCH):
            message = self.frames.next()
            if message is not None:
                found.append(message)
            elif not self._read():
                break
        return found

    def _read(self) -> bool:
        """Take in what can be read now; False if that is nothing."""
        if self.closed:
            return False
        try:
            data = os.read(self._reader, _CHUNK)
        except BlockingIOError:
            return False
        except OSError:
            data = b""
        self.closed = not data
        self.received += len(data)
        self.frames.feed(data)
        return not self.closed

    def close(self) -> None:
        """Close both descriptors. Idempotent."""
        self.closed = True
        for descriptor in {self._reader, self._writer}:
            with contextlib.suppress(OSError):
                os.close(descriptor)
        self._reader = self._writer = -1

    def _write(self) -> None:
        while self._waiting and not self.closed:
            try:
                written = os.write(self._writer, self._waiting[0][:_CHUNK])
            except BlockingIOError:
                return
            except OSError:
                self.closed = True
                return
            self.backlog -= written
            self._waiting[0] = self._waiting[0][written:]
            if not self._waiting[0]:
                self._waiting.popleft()
