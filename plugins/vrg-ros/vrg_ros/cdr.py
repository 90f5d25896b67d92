"""The bytes of ROS 2 messages: Common Data Representation, little-endian (OMG DDSI-RTPS 2.5, section 10).

Numbers are aligned to their size, counted from behind the header. A message is a mapping from the names of its fields
to their values; fields that are left out are 0, empty, or made of such.
"""

import struct
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any, Final

from vrg.errors import MessageError
from vrg_ros.types import FIELDS

HEADER: Final = b"\x00\x01\x00\x00"
_NUMBERS: Final = {
    "bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
    "float32": "f", "float64": "d",
}  # fmt: skip
_MAX_ELEMENTS: Final = 1 << 24
"""The number of elements above which a sequence is taken to be garbage."""

Message = Mapping[str, Any]


def encode(kind: str, message: Message) -> bytes:
    """The bytes of a message of a type such as `nav_msgs/Odometry`.

    Raises:
        ValueError: a field is unknown, or its value is not of its type.
    """
    out = bytearray(HEADER)
    try:
        _write(out, kind, message)
    except (struct.error, TypeError, AttributeError, UnicodeError) as error:
        raise ValueError(f"{kind}: a value is not of its type: {error}") from None
    return bytes(out)


def decode(kind: str, data: bytes) -> dict[str, Any]:
    """The message of a type that stands in bytes.

    Raises:
        MessageError: they are none of that type.
    """
    if data[: len(HEADER)] != HEADER:
        raise MessageError(f"{kind}: expected little-endian CDR, got bytes that begin with {data[:4].hex() or 'none'}")
    try:
        found: tuple[dict[str, Any], int] = _read(data, len(HEADER), kind)
    except (struct.error, UnicodeDecodeError) as error:
        raise MessageError(f"{kind}: the bytes end too early, or are of another type: {error}") from None
    message, end = found
    if len(data) - end >= 4:
        raise MessageError(f"{kind}: expected {end} bytes, got {len(data)}")
    return message


def _write(out: bytearray, kind: str, value: Any) -> None:
    if kind in _NUMBERS:
        _pack(out, _NUMBERS[kind], (value,))
    elif kind == "string":
        text = value.encode()
        _pack(out, "I", (len(text) + 1,))
        out += text + b"\0"
    elif kind.endswith("]"):
        element, _, count = kind[:-1].partition("[")
        if not count:
            _pack(out, "I", (len(value),))
        elif len(value) != int(count):
            raise ValueError(f"expected {count} values, got {len(value)}")
        if element in _NUMBERS:
            _pack(out, _NUMBERS[element], value)
        else:
            for each in value:
                _write(out, element, each)
    elif form := _only(kind):
        numbers: list[Any] = []
        _collect(numbers, kind, value)
        _pack(out, form, numbers)
    else:
        for name, of in _fields(kind, value).items():
            _write(out, of, value[name] if name in value else _empty(of))


def _fields(kind: str, value: Message) -> Mapping[str, str]:
    """The fields of a type, whose names are all that a value may have."""
    fields = FIELDS[kind]
    if not value.keys() <= fields.keys():
        raise ValueError(f"{kind} has no field {', '.join(sorted(value.keys() - fields.keys()))}")
    return fields


@cache
def _only(kind: str) -> str:
    """The form of the numbers of which alone a type is made; empty if there are others in it."""
    if kind in _NUMBERS:
        return _NUMBERS[kind]
    if kind.endswith("]"):
        element, _, count = kind[:-1].partition("[")
        return _NUMBERS.get(element, "") if count else ""
    forms = {_only(of) for of in FIELDS.get(kind, {}).values()} or {""}
    return forms.pop() if len(forms) == 1 else ""


def _collect(numbers: list[Any], kind: str, value: Message) -> None:
    """Put the numbers of a value of a type that has no others into a list, in their order."""
    for name, of in _fields(kind, value).items():
        if of in _NUMBERS:
            numbers.append(value.get(name, 0))
        elif of in FIELDS:
            _collect(numbers, of, value.get(name, {}))
        else:
            own = value[name] if name in value else _empty(of)
            count = int(of[:-1].partition("[")[2])
            if len(own) != count:
                raise ValueError(f"expected {count} values, got {len(own)}")
            numbers.extend(own)


def _pack(out: bytearray, form: str, values: Sequence[Any]) -> None:
    if count := len(values):
        packed = _struct(form, count)
        out += bytes(-(len(out) - len(HEADER)) % (packed.size // count))
        out += packed.pack(*values)


@lru_cache(maxsize=256)
def _struct(form: str, count: int) -> struct.Struct:
    return struct.Struct(f"<{count}{form}")


def _empty(kind: str) -> Any:
    """The value of a field that is left out."""
    if kind in _NUMBERS:
        return 0
    if kind == "string":
        return ""
    if kind.endswith("]"):
        element, _, count = kind[:-1].partition("[")
        return [_empty(element)] * int(count or 0)
    return {}


def _read(data: bytes, at: int, kind: str) -> tuple[Any, int]:
    """A value and where the next one begins."""
    if kind in _NUMBERS:
        (value,), at = _unpack(data, at, _NUMBERS[kind], 1)
        return value, at
    if kind == "string":
        (size,), at = _unpack(data, at, "I", 1)
        if not 0 < size <= len(data) - at:
            raise struct.error(f"a string of {size} bytes")
        return data[at : at + size - 1].decode(), at + size
    if kind.endswith("]"):
        element, _, given = kind[:-1].partition("[")
        (count,), at = ((int(given),), at) if given else _unpack(data, at, "I", 1)
        if count > _MAX_ELEMENTS:
            raise struct.error(f"a sequence of {count}")
        if element in _NUMBERS:
            values, at = _unpack(data, at, _NUMBERS[element], count)
            return list(values), at
        found = []
        for _ in range(count):
            one, at = _read(data, at, element)
            found.append(one)
        return found, at
    message = {}
    for name, of in FIELDS[kind].items():
        message[name], at = _read(data, at, of)
    return message, at


def _unpack(data: bytes, at: int, form: str, count: int) -> tuple[tuple[Any, ...], int]:
    if not count:
        return (), at
    size = struct.calcsize(form)
    at += -(at - len(HEADER)) % size
    return struct.unpack_from(f"<{count}{form}", data, at), at + size * count
