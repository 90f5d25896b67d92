"""The wire format of Protocol Buffers, as far as vision of the Small Size League needs it: messages as plain tables.

The format is that of protobuf.dev/programming-guides/encoding. A packet may come from anybody, so nothing in it is
believed: what is malformed raises an error, and fields that are not in a layout are skipped.
"""

import enum
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from vrg.errors import MessageError

_LONGEST_VARINT: Final = 10
"""The number of bytes of a varint of 64 bits."""


class Kind(enum.Enum):
    """The kinds of numbers, by their wire types."""

    UINT = 0
    DOUBLE = 1
    FLOAT = 5


_MESSAGE: Final = 2
"""The wire type of a message in another one, of text and of bytes."""
_NUMBERS: Final = {Kind.DOUBLE: struct.Struct("<d"), Kind.FLOAT: struct.Struct("<f")}

Layout = Mapping[int, "Field"]
"""The fields of a message, by their numbers."""


@dataclass(frozen=True)
class Field:
    """A field of a message.

    Args:
        name: its name. kind: what it holds, or the layout of the message in it. many: whether it may be there often.
    """

    name: str
    kind: "Kind | Layout"
    many: bool = False


def decode(data: bytes, layout: Layout) -> dict[str, Any]:
    """The values of a message by the fields' names. One that is not there is missing; one of `many` is a list.

    Raises:
        MessageError: it is malformed.
    """
    found: dict[str, Any] = {field.name: [] for field in layout.values() if field.many}
    for number, wire, value in _fields(data):
        field = layout.get(number)
        if field is None:
            continue
        wanted = field.kind.value if isinstance(field.kind, Kind) else _MESSAGE
        if wire != wanted:
            raise MessageError(f"{field.name}: expected the wire type {wanted}, got {wire}")
        read: Any = value
        if not isinstance(field.kind, Kind):
            read = decode(value, field.kind)
        elif field.kind is not Kind.UINT:
            (read,) = _NUMBERS[field.kind].unpack(value)
        if field.many:
            found[field.name].append(read)
        else:
            found[field.name] = read
    return found


def _fields(data: bytes) -> Iterator[tuple[int, int, Any]]:
    """The number, the wire type and the raw value of each field: an int for the wire type 0, else bytes."""
    at = 0
    while at < len(data):
        key, at = _read_varint(data, at)
        number, wire = key >> 3, key & 7
        value: int | bytes
        if wire == 0:
            value, at = _read_varint(data, at)
        else:
            if wire == _MESSAGE:
                size, at = _read_varint(data, at)
            elif wire in (1, 5):
                size = 8 if wire == 1 else 4
            else:
                raise MessageError(f"field {number}: expected a wire type of 0, 1, 2 or 5, got {wire}")
            if at + size > len(data):
                raise MessageError(f"field {number}: expected {size} bytes, got {len(data) - at}")
            value, at = data[at : at + size], at + size
        yield number, wire, value


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    """A number, and where the next byte is."""
    value = 0
    for place in range(_LONGEST_VARINT):
        if at + place >= len(data):
            raise MessageError("expected the rest of a number, found the end")
        byte = data[at + place]
        value |= (byte & 0x7F) << 7 * place
        if not byte & 0x80:
            return value % (1 << 64), at + place + 1
    raise MessageError(f"expected a number of at most {_LONGEST_VARINT} bytes, got a longer one")
