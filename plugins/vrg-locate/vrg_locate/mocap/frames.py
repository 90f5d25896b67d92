"""Frames of a capture system as they are handed from the process that listens to it to the match.

Each message is MessagePack after its length in bytes, an unsigned number of 32 bits, little-endian.
"""

import struct
from typing import IO, Final

import msgspec
from msgspec import Struct

_LENGTH: Final = struct.Struct("<I")


class MeasuredBody(Struct, frozen=True):
    """A rigid body as a system has measured it. Numbers are not finite where it has not.

    Args:
        name: in the system. position: x, y, z in the system's frame, m.
        rotation: the quaternion w, x, y, z that turns the body's axes from those of the system.
    """

    name: str
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


class MocapFrame(Struct, frozen=True, tag="frame"):
    """The rigid bodies at one instant.

    Args:
        time: when it arrived, monotonic, s.
    """

    time: float
    bodies: list[MeasuredBody]


class Trouble(Struct, frozen=True, tag="trouble"):
    """Says that there will be no frames, and why."""

    text: str


class Request(Struct, frozen=True):
    """The system that is to be listened to.

    Args:
        system: its name in the library. options: the library's for it.
        rate: the most measurements of each body in a second that are wanted. patience: how long nothing may come, s.
    """

    system: str
    options: dict[str, str]
    rate: float
    patience: float


_DECODER: Final = msgspec.msgpack.Decoder(MocapFrame | Trouble)


def encode(message: MocapFrame | Trouble) -> bytes:
    """A message with its length."""
    data = msgspec.msgpack.encode(message)
    return _LENGTH.pack(len(data)) + data


def read(stream: IO[bytes]) -> MocapFrame | Trouble | None:
    """The next message of a stream; None if it is over."""
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = stream.read(length)
    return _DECODER.decode(data) if len(data) == length else None
