"""The frames of moteus: identifiers, and the subframes that write, ask for and tell registers. Pure functions.

An identifier is `reply << 15 | source << 8 | destination`; the highest bit asks for an answer. It is a 29-bit one where
11 bits are too few. Data are subframes one after the other. The first byte of each says what it does, in which
resolution, and to how many registers; then come the number of the first register and its values, little-endian.
"""

import enum
import math
import struct
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from vrg.hal.can.frame import FD_BYTES, STANDARD_MASK, Frame, FrameError, fd_size

NODE_IDS = range(1, 0x7F)
"""The ids that a drive can have."""
BROADCAST = 0x7F
"""The destination that means every drive."""
_LARGEST = 0xFFFF
_REPLY = 0x8000
_NOP = 0x50
_ERRORS = (0x30, 0x31)
_CHANNEL = 1
"""The diagnostic channel of the drive's console."""
_MOST_TEXT = FD_BYTES - 3
"""The most bytes of text that one frame has room for."""
_MOST_BYTES = 5
"""The most bytes of a number that has as many as it needs."""


class Resolution(enum.IntEnum):
    """The format of a value."""

    INT8 = 0
    INT16 = 1
    INT32 = 2
    F32 = 3


_PACKINGS = [struct.Struct("<b"), struct.Struct("<h"), struct.Struct("<i"), struct.Struct("<f")]
_LEAST = [-(1 << 7), -(1 << 15), -(1 << 31)]
"""The integers that stand for NaN."""


class SubframeKind(enum.IntEnum):
    """The kind of a subframe: the high bits of its first byte."""

    WRITE = 0x00
    READ = 0x10
    REPLY = 0x20


class Subframe(NamedTuple):
    """Some registers that follow one another.

    Args:
        kind: they are written, requested or reported. register: the number of the first one.
        resolution: how their values are written.
        values: one raw value for each register; integers unless the resolution is F32. In a READ they mean nothing.
    """

    kind: SubframeKind
    register: int
    resolution: Resolution
    values: tuple[float, ...]


class ArbitrationId(NamedTuple):
    """The parts of an identifier.

    Args:
        source, destination: who sends it to whom. reply: an answer is wanted.
    """

    source: int
    destination: int
    reply: bool


def frame_id(source: int, destination: int, *, reply: bool = False) -> int:
    """The identifier of a frame."""
    return (_REPLY if reply else 0) | source << 8 | destination


def is_plain(frame: Frame) -> bool:
    """True if a frame may be of this protocol: moteus receives no frame whose identifier has more than 16 bits.

    Those are its "CAN prefix", which is 0 unless a person has set it.
    """
    return not frame.remote and frame.id <= _LARGEST


def address_of(identifier: int) -> ArbitrationId:
    """The meaning of an identifier that `is_plain`."""
    return ArbitrationId(identifier >> 8 & 0x7F, identifier & 0x7F, bool(identifier & _REPLY))


def encode(source: int, destination: int, subframes: Iterable[Subframe], *, reply: bool = False) -> Frame:
    """The CAN FD frame of some subframes, filled up with what means nothing.

    Raises:
        ValueError: they do not fit into one frame.
    """
    return _frame(source, destination, b"".join(_packed(subframe) for subframe in subframes), reply)


def _frame(source: int, destination: int, data: bytes, reply: bool) -> Frame:
    identifier = frame_id(source, destination, reply=reply)
    size = fd_size(len(data))
    return Frame(identifier, data.ljust(size, bytes([_NOP])), extended=identifier > STANDARD_MASK, fd=True)


class Console(enum.IntEnum):
    """The first byte of a frame of the drive's console, its diagnostic channel, which tools type text into."""

    TYPE = 0x40
    TELL = 0x41
    ASK = 0x42


def console(source: int, destination: int, kind: Console, text: bytes = b"") -> Frame:
    """The frame that types up to 61 bytes of text into a drive's console, tells what it has printed, or asks for it."""
    asks = kind is Console.ASK
    head = bytes([kind, _CHANNEL, _MOST_TEXT if asks else len(text)])
    return _frame(source, destination, head + text, reply=asks)


def console_text(frame: Frame, kind: Console) -> bytes | None:
    """The text in a frame of a console, empty in one that asks for text; None for any other frame."""
    data = frame.data
    if len(data) < 3 or data[0] != kind or data[1] != _CHANNEL:
        return None
    return b"" if kind is Console.ASK else data[3 : 3 + data[2]]


def write(register: int, values: Sequence[float], resolution: Resolution = Resolution.F32) -> Subframe:
    """The subframe that writes registers."""
    return Subframe(SubframeKind.WRITE, register, resolution, tuple(values))


def read(register: int, count: int = 1, resolution: Resolution = Resolution.F32) -> Subframe:
    """The subframe that asks for registers."""
    return Subframe(SubframeKind.READ, register, resolution, (0.0,) * count)


def decode(frame: Frame) -> list[Subframe]:
    """The subframes of a frame. Errors that a drive reports of single registers are left out.

    Raises:
        FrameError: it is no frame of moteus, with what was expected.
    """
    found = []
    reader = _Reader(frame.data)
    while reader.left:
        first = reader.byte()
        if first == _NOP:
            continue
        if first in _ERRORS:
            reader.number()
            reader.number()
            continue
        if first >= 0x30:
            raise FrameError(f"subframe 0x{first:02X}: expected one that writes, asks for or tells registers")
        kind, resolution = SubframeKind(first & 0x30), Resolution(first >> 2 & 3)
        count = first & 3 or reader.number()
        register = reader.number()
        values = tuple([0.0] * min(count, 64) if kind is SubframeKind.READ else reader.values(resolution, count))
        found.append(Subframe(kind, register, resolution, values))
    return found


class Scale(NamedTuple):
    """One step of an integer register, in the unit of the value."""

    int8: float
    int16: float
    int32: float

    def value(self, raw: float, resolution: Resolution) -> float:
        """The value of a register; NaN where the least integer stands for it."""
        if resolution is Resolution.F32:
            return raw
        return math.nan if raw == _LEAST[resolution] else raw * self[resolution]

    def raw(self, value: float, resolution: Resolution) -> float:
        """A value as a register has it; what does not fit is limited."""
        if resolution is Resolution.F32:
            return value
        least = _LEAST[resolution]
        if not math.isfinite(value):
            return least
        return max(least + 1, min(-least - 1, round(value / self[resolution])))


WHOLE = Scale(1.0, 1.0, 1.0)
"""The scale of numbers that count or name something."""


class _Reader:
    """Reads data byte by byte."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def left(self) -> int:
        return len(self._data) - self._at

    def byte(self) -> int:
        return self._take(1)[0]

    def number(self) -> int:
        """A number of which each byte carries seven bits, the lowest first."""
        value = 0
        for index in range(_MOST_BYTES):
            byte = self.byte()
            value |= (byte & 0x7F) << (7 * index)
            if not byte & 0x80:
                return value
        raise FrameError(f"expected a number of at most {_MOST_BYTES} bytes")

    def values(self, resolution: Resolution, count: int) -> list[float]:
        packing = _PACKINGS[resolution]
        if count * packing.size > self.left:
            raise FrameError(f"expected {count} values of {packing.size} bytes, got {self.left} bytes")
        return [packing.unpack(self._take(packing.size))[0] for _ in range(count)]

    def _take(self, count: int) -> bytes:
        if count > self.left:
            raise FrameError(f"expected {count} bytes more, got {self.left}")
        taken = self._data[self._at : self._at + count]
        self._at += count
        return taken


def _packed(subframe: Subframe) -> bytes:
    count = len(subframe.values)
    first = subframe.kind | subframe.resolution << 2
    head = bytes([first | count]) if count <= 3 else bytes([first]) + _number(count)
    head += _number(subframe.register)
    if subframe.kind is SubframeKind.READ:
        return head
    packing = _PACKINGS[subframe.resolution]
    whole = subframe.resolution is not Resolution.F32
    return head + b"".join(packing.pack(int(value) if whole else value) for value in subframe.values)


def _number(value: int) -> bytes:
    found = bytearray()
    while True:
        value, low = value >> 7, value & 0x7F
        found.append(low | (0x80 if value else 0))
        if not value:
            return bytes(found)
