"""PNG files of pictures, beside another program's reader and writer."""

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib import image

from vrg.hal.sensors import png

sides = st.integers(1, 40)


def picture(width: int, height: int, seed: int, *, plain: bool = False) -> np.ndarray:  # type: ignore[type-arg]
    rng = np.random.default_rng(seed)
    if plain:
        return np.full((height, width, 3), rng.integers(0, 256, 3), dtype=np.uint8)
    return rng.integers(0, 256, (height, width, 3), dtype=np.uint8)


@given(sides, sides, st.integers(0, 99), st.booleans())
def test_a_picture_comes_back_and_others_read_it(width: int, height: int, seed: int, plain: bool) -> None:
    taken = picture(width, height, seed, plain=plain)
    data = png.encode(taken)
    assert png.size_of(data) == (width, height)
    found = png.decode(data)
    assert (found.dtype, found.shape) == (np.uint8, (height, width, 3))
    assert (found == taken).all()
    assert (np.rint(image.imread(io.BytesIO(data), format="png") * 255) == taken).all()


def written(
    rows: list[bytes], width: int, *, parts: int = 1, head: tuple[int, ...] = (8, 2, 0, 0, 0), height: int = 0
) -> bytes:
    """A file of filtered rows, with its data in several chunks, and perhaps another height in its head."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    body = zlib.compress(b"".join(rows))
    step = -(-len(body) // parts)
    cut = [body[at : at + step] for at in range(0, len(body), step)]
    first = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height or len(rows), *head)) + chunk(b"tEXt", b"a\0b")
    return b"\x89PNG\r\n\x1a\n" + first + b"".join(chunk(b"IDAT", part) for part in cut) + chunk(b"IEND", b"")


def filtered(kind: int, row: np.ndarray, above: np.ndarray) -> bytes:  # type: ignore[type-arg]
    """A row as the PNG specification filters it: each byte less a guess from its neighbours."""
    width = len(row)
    out = bytearray([kind])
    for column in range(width):
        for channel in range(3):
            a = int(row[column - 1, channel]) if column else 0
            b = int(above[column, channel])
            c = int(above[column - 1, channel]) if column else 0
            p = a + b - c
            near = sorted((abs(p - value), order, value) for order, value in enumerate((a, b, c)))[0][2]
            guess = (0, a, b, (a + b) // 2, near)[kind]
            out.append((int(row[column, channel]) - guess) % 256)
    return bytes(out)


@given(sides, st.lists(st.integers(0, 4), min_size=1, max_size=12), st.integers(0, 99), st.integers(1, 3))
def test_every_filter_of_the_format_is_read(width: int, kinds: list[int], seed: int, parts: int) -> None:
    taken = picture(width, len(kinds), seed)
    above = np.zeros((width, 3), dtype=np.uint8)
    rows = []
    for kind, row in zip(kinds, taken, strict=True):
        rows.append(filtered(kind, row, above))
        above = row
    assert (png.decode(written(rows, width, parts=parts)) == taken).all()


GOOD = png.encode(picture(4, 3, 1))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "got 0 bytes"),
        (b"GIF89a" + bytes(100), "expected a PNG file"),
        (written([bytes(5)], 4, head=(8, 0, 0, 0, 0)), "expected a PNG file of RGB"),
        (written([bytes(13)], 4, head=(8, 2, 0, 0, 1)), "not interlaced"),
        (GOOD[:16] + struct.pack(">I", 100_000) + GOOD[20:], "expected 1 to 1920 pixels a side, got 100000 x 3"),
        (GOOD[:16] + struct.pack(">I", 0) + GOOD[20:], "expected 1 to 1920 pixels a side, got 0 x 3"),
        (GOOD[:40], "got a damaged one"),
        (GOOD[:45] + b"\xff\xff\xff" + GOOD[48:], "expected"),
        (written([b"\x07" + bytes(12)], 4), "got a damaged one"),
    ],
)
def test_what_is_no_such_picture_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        png.decode(data)


@given(st.integers(0, len(GOOD)), st.binary(max_size=8))
def test_a_damaged_file_is_a_picture_or_an_error_in_words(at: int, junk: bytes) -> None:
    try:
        found = png.decode(GOOD[:at] + junk + GOOD[at + len(junk) :])
    except ValueError:
        return
    assert found.dtype == np.uint8


def test_no_more_is_unpacked_than_the_picture_needs() -> None:
    """A few kilobytes could unpack to gigabytes."""
    rows = [b"\x00" + bytes(12)] * 3
    bomb = written([*rows, bytes(50_000_000)], 4, height=3)
    assert png.decode(bomb).shape == (3, 4, 3)


def test_an_even_picture_is_small() -> None:
    assert len(png.encode(picture(320, 240, 1, plain=True))) < 2000
