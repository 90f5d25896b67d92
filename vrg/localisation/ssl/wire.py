"""The wire format of Protocol Buffers, as far as the Small Size League uses it: messages as tables of plain values.

The format is that of protobuf.dev/programming-guides/encoding. A packet may come from anybody, so nothing in it is
believed: what is malformed raises an error, and fields that are not in a layout are skipped.
"""

import enum
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from vrg.errors import MessageError

_LONGEST_VARINT: Final = 10
"""The number of bytes of a varint of 64 bits."""


class Kind(enum.Enum):
    """The kinds of numbers and texts."""

    UINT = enum.auto()
    SINT = enum.auto()
    INT = enum.auto()
    DOUBLE = enum.auto()
    FLOAT = enum.auto()
    TEXT = enum.auto()


_WIRE: Final = {Kind.UINT: 0, Kind.SINT: 0, Kind.INT: 0, Kind.DOUBLE: 1, Kind.TEXT: 2, Kind.FLOAT: 5}
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
        wanted = _WIRE[field.kind] if isinstance(field.kind, Kind) else 2
        if wire != wanted:
            raise MessageError(f"{field.name}: expected the wire type {wanted}, got {wire}")
        read = _value(field.kind, value) if isinstance(field.kind, Kind) else decode(bytes(value), field.kind)
        if field.many:
            found[field.name].append(read)
        else:
            found[field.name] = read
    return found


def encode(values: Mapping[str, Any], layout: Layout) -> bytes:
    """The bytes of a message; fields that are missing, or None, are left out."""
    parts: list[bytes] = []
    for number, field in layout.items():
        value = values.get(field.name)
        if value is None:
            continue
        for one in value if field.many else (value,):
            parts += _encoded(number, field, one)
    return b"".join(parts)


def _encoded(number: int, field: Field, value: Any) -> Sequence[bytes]:
    kind = field.kind
    if not isinstance(kind, Kind) or kind is Kind.TEXT:
        data = encode(value, kind) if not isinstance(kind, Kind) else value.encode()
        return _varint(number << 3 | 2), _varint(len(data)), data
    head = _varint(number << 3 | _WIRE[kind])
    if kind in _NUMBERS:
        return head, _NUMBERS[kind].pack(value)
    if kind is Kind.SINT:
        value = value << 1 if value >= 0 else (-value << 1) - 1
    return head, _varint(value % (1 << 64))


def _varint(value: int) -> bytes:
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    return bytes(found)


def _fields(data: bytes) -> Iterator[tuple[int, int, int | bytes]]:
    """The number, the wire type and the raw value of each field."""
    at = 0
    while at < len(data):
        key, at = _read_varint(data, at)
        number, wire = key >> 3, key & 7
        value: int | bytes
        if wire == 0:
            value, at = _read_varint(data, at)
        else:
            if wire == 2:
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


def _value(kind: Kind, value: int | bytes) -> Any:
    if isinstance(value, bytes):
        if kind is Kind.TEXT:
            return value.decode(errors="replace")
        return _NUMBERS[kind].unpack(value)[0]
    if kind is Kind.SINT:
        return -((value + 1) >> 1) if value & 1 else value >> 1
    return value - (1 << 64) if kind is Kind.INT and value >= 1 << 63 else value
