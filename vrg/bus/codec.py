"""The codec that turns messages into MessagePack and back.

On the wire a message is a MessagePack array `[format, version, sender, key, sequence, stamp, body]`; body is a map by
field name. The key is the one that the sender has published on: zenoh may deliver a message under another key after a
link was lost, so a receiver believes only what names the key that it came on.
"""

import threading
from typing import Annotated, Final, Generic, TypeVar

import msgspec
from msgspec import Meta, Raw, Struct

from vrg.bus.messages import Message
from vrg.errors import MessageError, MisroutedError
from vrg.types import printable

WIRE: Final = 2
"""The version of the array that every message is. A receiver refuses every other one."""
SEQUENCES: Final = 2**32
"""The number of messages that one sender may publish on one key: recordings have 32 bits for the number of each."""
SENDER_LENGTH: Final = 400
"""The length of the longest sender, in characters. A name of 64 characters may have four times as many in a key."""

T = TypeVar("T", bound=Message)
T_co = TypeVar("T_co", bound=Message, covariant=True)

_encoder = msgspec.msgpack.Encoder()
_LAYOUT: Final = "[format, version, sender, key, sequence, stamp, body]"
_bodies: dict[type[Message], msgspec.msgpack.Decoder[Message]] = {}
_making = threading.Lock()


class Received(Struct, Generic[T_co], frozen=True, gc=False):
    """A message that has arrived, with its key, its stamp, its number and its sender.

    Args:
        key: the key that it came on.
        stamp: the match time of the measurement, or of the sender's tick, s.
        sequence: counts the sender's messages on this key from 0; it is less than SEQUENCES.
        body: the message itself.
        sender: the kind and the name of the node that has published it, such as `player/ann`. One received over the bus
            has the instance of the sender's process behind them, such as `player/ann/3f60c1d2`.
    """

    key: str
    stamp: float
    sequence: int
    body: T_co
    sender: str = ""


class Header(Struct, frozen=True, array_like=True, forbid_unknown_fields=True, gc=False):
    """The fields before the body of a message, and the encoded body."""

    format: int
    version: int
    sender: Annotated[str, Meta(max_length=SENDER_LENGTH)]
    key: str
    sequence: Annotated[int, Meta(ge=0, lt=SEQUENCES)]
    stamp: Annotated[float, Meta(ge=0.0, le=1e8)]
    body: Raw


_header = msgspec.msgpack.Decoder(Header)


def encode(message: Received[Message], sender: str | None = None) -> bytes:
    """Encode a message for the wire.

    Args:
        sender: stands on the wire in place of the message's own.
    """
    body = message.body
    return _encoder.encode(
        (
            WIRE,
            body.version,
            message.sender if sender is None else sender,
            message.key,
            message.sequence,
            message.stamp,
            body,
        )
    )


DIGESTS: Final = 2
"""The number of what digests of messages are made of: it rises when `content` changes."""


def content(message: Received[Message]) -> bytes:
    """What a message says, encoded: all but how many its sender has published."""
    return _encoder.encode((message.body.version, message.key, message.stamp, message.body))


def checked(body: T) -> T:
    """Return a message as its receivers would get it. Numbers in it may be numpy's.

    Raises:
        MessageError: a value is out of range, NaN, or of another type, or a list is too long.
    """
    try:
        return msgspec.convert(msgspec.to_builtins(body, enc_hook=plain), type(body))
    except (msgspec.ValidationError, TypeError) as error:
        raise MessageError(f"expected {type(body).__name__}: {error}") from None


def plain(value: object) -> object:
    """Convert numpy's numbers and arrays into Python's own, for msgspec.

    Raises:
        TypeError: the value is none of these.
    """
    tolist = getattr(value, "tolist", None)
    if callable(tolist):
        return tolist()
    raise TypeError(f"expected numbers, strings, lists and tables, got {type(value).__name__}")


def header(payload: bytes, key: str) -> Header:
    """The header of a message that came on a key. The body is not looked at.

    Raises:
        MisroutedError: it was published on another key.
        MessageError: the payload is no message, or of another format.
    """
    try:
        found = _header.decode(payload)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as error:
        raise MessageError(f"{key}: expected a message {_LAYOUT} of format {WIRE}: {printable(str(error))}") from None
    if found.format != WIRE:
        raise MessageError(
            f"{key}: expected a message of format {WIRE}, got {found.format}: run the same release of vrg everywhere"
        )
    if found.key != key:
        raise MisroutedError(key, found.key, found.sender)
    return found


def decoder_of(message_type: type[T]) -> msgspec.msgpack.Decoder[T]:
    """The decoder of the bodies of a type of messages, for any thread."""
    if (known := _bodies.get(message_type)) is not None:
        return known  # type: ignore[return-value]
    # msgspec describes a type to itself when it first meets it. A description that another thread has only half made
    # crashes the process, so one thread at a time makes decoders.
    with _making:
        decoder = _bodies.get(message_type)
        if decoder is None:
            decoder = _bodies[message_type] = msgspec.msgpack.Decoder(message_type)
        return decoder  # type: ignore[return-value]


def decode(payload: bytes, message_type: type[T], key: str) -> Received[T]:
    """Decode and validate a message that came on a key.

    Raises:
        MisroutedError: it was published on another key.
        MessageError: the payload is truncated, nested too deep or of another version, a field is unknown or missing, or
            a value is out of range or NaN.
    """
    return decode_body(header(payload, key), message_type)


def decode_body(head: Header, message_type: type[T]) -> Received[T]:
    """Decode and validate the body behind a header.

    Raises:
        MessageError: see `decode`.
    """
    if head.version != message_type.version:
        raise MessageError(
            f"{head.key}: expected version {message_type.version} of {message_type.__name__}, got {head.version}: "
            "run the same release of vrg everywhere"
        )
    try:
        body = decoder_of(message_type).decode(head.body)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as error:
        raise MessageError(f"{head.key}: expected {message_type.__name__}: {printable(str(error))}") from None
    return Received(head.key, head.stamp, head.sequence, body, head.sender)
