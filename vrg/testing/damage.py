"""What happens to files: a power cut, a disk that rots, somebody who edits them. Mutants of their content, by seeds.

Whoever reads a file of others refuses in words what is wrong with it: `check_refused` and `check_no_file`.
"""

import contextlib
import os
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from vrg.errors import VrgError

Damage = Callable[[random.Random, bytes], bytes]

_TOKEN = re.compile(rb'"[^"\n]{0,40}"|-?\d+\.?\d*(?:[eE][+-]?\d+)?|true|false|null')
_ODD = [*rb'null [] {} -1 1e308 -1e-320 NaN "" "\u0000\u001b[2J" true'.split(), b"1" * 40, b'"\xff"']


def _at(rng: random.Random, content: bytes) -> int:
    return rng.randrange(len(content) + 1)


def cut(rng: random.Random, content: bytes) -> bytes:
    """Only its beginning is there."""
    return content[: _at(rng, content)]


def zeros(rng: random.Random, content: bytes) -> bytes:
    """A power cut: the blocks behind its beginning are on disk, but full of zeros."""
    return cut(rng, content) + bytes(rng.choice([1, 37, 4096]))


def garbage(rng: random.Random, content: bytes) -> bytes:
    """A power cut: behind its beginning is what was on the disk before."""
    return cut(rng, content) + rng.randbytes(rng.choice([1, 37, 4096]))


def tail(rng: random.Random, content: bytes) -> bytes:
    """It is whole, and something follows."""
    return content + rng.choice([bytes(4096), rng.randbytes(300), b"\xff\n", b"{}\n", b"\n\n"])


def bits(rng: random.Random, content: bytes) -> bytes:
    """Some bits are others."""
    changed = bytearray(content)
    for _ in range(rng.choice([1, 1, 3, 20])):
        if changed:
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def hole(rng: random.Random, content: bytes) -> bytes:
    """A part is missing, or is there twice."""
    begin, end = sorted((_at(rng, content), _at(rng, content)))
    end = min(end, begin + 300)
    return content[:begin] + content[end:] if rng.random() < 0.5 else content[:end] + content[begin:]


def edited(rng: random.Random, content: bytes) -> bytes:
    """Somebody has changed a key, a text or a number of a text file."""
    found = list(_TOKEN.finditer(content))
    if not found:
        return bits(rng, content)
    token = rng.choice(found)
    new = rng.choice([*_ODD, rng.choice(found)[0], token[0][:-1] + b"x" + token[0][-1:]])
    # One such token, or all that are alike, as `sed` does.
    return (
        content.replace(token[0], new)
        if rng.random() < 0.3
        else content[: token.start()] + new + content[token.end() :]
    )


DAMAGES: tuple[Damage, ...] = (cut, zeros, garbage, tail, bits, hole, edited, edited)


def mutants(content: bytes, count: int, seed: int = 0) -> Iterator[tuple[str, bytes]]:
    """The given number of mutants of a content, each with what has happened to it."""
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        damage = DAMAGES[number % len(DAMAGES)]
        yield f"{damage.__name__} {number}", damage(rng, content)


def deep(content: bytes) -> bytes:
    """As JSON or TOML: 200,000 brackets within one another."""
    return b"[" * 200_000 if content[:1] in b"{[" else b"a = " + b"[" * 200_000


def check_refused(read: Callable[[Path], object], file: Path, whole: bytes, count: int) -> None:
    """Check that what reads a file reads its mutants, too, or refuses them in words.

    Args:
        file: where they are written. whole: its content. count: the number of mutants.
    """
    for what, content in [*mutants(whole, count), ("deep", deep(whole))]:
        file.write_bytes(content)
        try:
            read(file)
        except (VrgError, OSError):
            continue
        except Exception as error:
            raise AssertionError(f"{file.name}, {what}: {content[:300]!r}") from error


def check_no_file(read: Callable[[Path], object], place: Path, name: str) -> None:
    """Check that what reads a file of this name waits for no pipe, reads no endless device, and survives a folder.

    Args:
        place: an empty folder.
    """
    for make in (os.mkfifo, lambda path: path.symlink_to("/dev/zero"), lambda path: path.mkdir()):
        folder = place / str(len(list(place.iterdir())))
        folder.mkdir()
        make(folder / name)
        with contextlib.suppress(VrgError, OSError):
            read(folder / name)
