"""The codec that turns messages into MessagePack and back.

On the wire a message is a MessagePack array `[version, sequence, stamp, body]`; body is a map by field name.
"""

import threading
from typing import Annotated, Generic, TypeVar

import msgspec
from msgspec import Meta, Raw, Struct

from vrg.bus.messages import Message
from vrg.errors import MessageError

T = TypeVar("T", bound=Message)
T_co = TypeVar("T_co", bound=Message, covariant=True)

_encoder = msgspec.msgpack.Encoder()
_header = msgspec.msgpack.Decoder(tuple[int, Annotated[int, Meta(ge=0)], Annotated[float, Meta(ge=0.0, le=1e8)], Raw])
_bodies: dict[type[Message], msgspec.msgpack.Decoder[Message]] = {}
_making = threading.Lock()


class Received(Struct, Generic[T_co], frozen=True, gc=False):
    """A message that has arrived, with its key, its stamp and its number.

    Args:
        key: the key that it came on.
        stamp: the match time of the measurement, or of the sender's tick, s.
        sequence: counts the sender's messages on this key from 0.
        body: the message itself.
    """

    key: str
    stamp: float
    sequence: int
    body: T_co


def encode(body: Message, stamp: float, sequence: int) -> bytes:
    """Encode a message for the wire."""
    return _encoder.encode((body.version, sequence, stamp, body))


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
    raise TypeError(f"expected numbers, texts, lists and tables, got {type(value).__name__}")


def header(payload: bytes, key: str) -> tuple[int, float]:
    """The number and the stamp of a message, without its body: (sequence, match time in s).

    Raises:
        MessageError: the payload is no message.
    """
    try:
        _, sequence, stamp, _ = _header.decode(payload)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as error:
        raise MessageError(f"{key}: expected a message: {error}") from None
    return sequence, stamp


def _new_decoder(message_type: type[Message]) -> msgspec.msgpack.Decoder[Message]:
    # msgspec describes a type to itself when it first meets it. A description that another thread has only half made
    # crashes the process, so one thread at a time makes decoders.
    with _making:
        decoder = _bodies.get(message_type)
        if decoder is None:
            decoder = _bodies[message_type] = msgspec.msgpack.Decoder(message_type)
        return decoder


def decode(payload: bytes, message_type: type[T], key: str) -> Received[T]:
    """Decode and validate a message.

    Raises:
        MessageError: the payload is truncated, nested too deep or of another version, a field is unknown or missing, or
            a value is out of range or NaN.
    """
    decoder = _bodies.get(message_type) or _new_decoder(message_type)
    try:
        version, sequence, stamp, raw = _header.decode(payload)
        if version != message_type.version:
            raise MessageError(
                f"{key}: expected version {message_type.version} of {message_type.__name__}, got {version}: "
                "run the same release of vrg everywhere"
            )
        body = decoder.decode(raw)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as error:
        raise MessageError(f"{key}: expected {message_type.__name__}: {error}") from None
    return Received(key, stamp, sequence, body)  # type: ignore[arg-type]
