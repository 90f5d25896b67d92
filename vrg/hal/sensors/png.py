"""PNG files of RGB pictures with 8 bits a channel: lossless, and readable by every program.

Pillow reads them. They are written here, by one filter of the PNG specification of the W3C: that is four times as fast,
and a world with cameras writes many. Only pictures that are not interlaced are read.
"""

import io
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
    from PIL import Image  # noqa: PLC0415 - most players look at no picture

    size_of(data)
    try:
        with Image.open(io.BytesIO(data), formats=["PNG"]) as picture:
            return np.asarray(picture)
    # Pillow lets through what its decoders raise; SyntaxError is its word for a broken file.
    except (
        OSError,
        SyntaxError,
        ValueError,
        EOFError,
        zlib.error,
        struct.error,
        Image.DecompressionBombError,
    ) as error:
        raise ValueError(f"expected a PNG file, got a damaged one: {error}") from None


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
