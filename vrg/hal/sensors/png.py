"""PNG files of RGB pictures with 8 bits a channel: lossless, and readable by every program.

The format is described in the PNG specification of the W3C. Only pictures that are not interlaced are read; they may
use every filter, so that a picture need not come from this module.
"""

import struct
import zlib
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Picture = npt.NDArray[np.uint8]

SIDE_LIMIT: Final = 1920
"""The largest width and height of a picture, pixels."""

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
_HEAD: Final = struct.Struct(">8sI4sIIBBBBB")
_RGB8: Final = (8, 2, 0, 0, 0)
"""Bits, colour type, compression, filter method and interlace method of the pictures that are read."""
_LEVEL: Final = 1
"""The level of compression. The pictures of a simulated camera are plain, so higher levels gain little."""


def encode(picture: "Picture") -> bytes:
    """Encode a picture of shape (height, width, 3), uint8.

    Each row is stored as its difference from the row above, which makes even areas zero.
    """
    import numpy as np  # noqa: PLC0415 - who only hands a file on needs no numpy

    height, width, _ = picture.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    flat = picture.reshape(height, 3 * width)
    rows[:, 0] = 2
    rows[0, 1:] = flat[0]
    np.subtract(flat[1:], flat[:-1], out=rows[1:, 1:])
    head = struct.pack(">IIBBBBB", width, height, *_RGB8)
    body = zlib.compress(rows.tobytes(), _LEVEL)
    return _SIGNATURE + _chunk(b"IHDR", head) + _chunk(b"IDAT", body) + _chunk(b"IEND", b"")


def size_of(data: bytes) -> tuple[int, int]:
    """The width and the height of a picture in pixels, from the first bytes of its file.

    Raises:
        ValueError: it is no PNG file of an RGB picture with 8 bits a channel, or it is larger than SIDE_LIMIT.
    """
    if len(data) < _HEAD.size:
        raise ValueError(f"expected a PNG file, got {len(data)} bytes")
    signature, _, kind, width, height, *how = _HEAD.unpack_from(data)
    if signature != _SIGNATURE or kind != b"IHDR":
        raise ValueError("expected a PNG file, got other bytes")
    if tuple(how) != _RGB8:
        raise ValueError("expected a PNG file of RGB with 8 bits, not interlaced")
    if not (0 < width <= SIDE_LIMIT and 0 < height <= SIDE_LIMIT):
        raise ValueError(f"expected 1 to {SIDE_LIMIT} pixels a side, got {width} x {height}")
    return width, height


def decode(data: bytes) -> "Picture":
    """Decode a picture: shape (height, width, 3), uint8.

    Raises:
        ValueError: it is no such PNG file, or it is torn.
    """
    import numpy as np  # noqa: PLC0415 - as above

    width, height = size_of(data)
    wanted = height * (1 + 3 * width)
    try:
        # A small file may unpack to any length, so no more is unpacked than the picture needs.
        unpacked = zlib.decompressobj().decompress(_body(data), wanted)
    except zlib.error as error:
        raise ValueError(f"expected a PNG file, got a damaged one: {error}") from None
    if len(unpacked) < wanted:
        raise ValueError(f"expected {wanted} bytes of a picture of {width} x {height}, got {len(unpacked)}")
    rows = np.frombuffer(unpacked, dtype=np.uint8).reshape(height, 1 + 3 * width)
    if (rows[:, 0] > 4).any():
        raise ValueError("expected the five filters of PNG, got another one")
    picture = np.empty((height, width, 3), dtype=np.uint8)
    above = np.zeros((width, 3), dtype=np.uint8)
    for number, row in enumerate(rows):
        above = picture[number] = _unfiltered(int(row[0]), row[1:].reshape(width, 3), above)
    return picture


def _unfiltered(kind: int, row: "Picture", above: "Picture") -> "Picture":
    """A row without its filter, given the row above: both of shape (width, 3)."""
    import numpy as np  # noqa: PLC0415 - as above

    if kind == 0:
        return row
    if kind == 1:
        return np.cumsum(row, axis=0, dtype=np.uint8)
    if kind == 2:
        return row + above
    found = np.empty_like(row)
    for channel in range(3):
        left = corner = 0
        for column, (step, up) in enumerate(zip(row[:, channel].tolist(), above[:, channel].tolist(), strict=True)):
            guess = (left + up) // 2 if kind == 3 else _paeth(left, up, corner)
            left, corner = (step + guess) & 0xFF, up
            found[column, channel] = left
    return found


def _paeth(left: int, up: int, corner: int) -> int:
    """The neighbour that is nearest to left + up - corner."""
    guess = left + up - corner
    return min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _body(data: bytes) -> bytes:
    """The compressed rows, which may be in several chunks."""
    parts, at = [], len(_SIGNATURE)
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IDAT":
            parts.append(data[at + 8 : at + 8 + length])
        at += 12 + length
    return b"".join(parts)
