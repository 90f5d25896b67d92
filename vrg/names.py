"""Names of matches, players and robots, and how each becomes one part of a key.

People write names in their own language. Keys are ASCII, so that a program in any language can write them: a name that
is not ASCII becomes `x--` and its Punycode (RFC 3492), as in names of the internet.
"""

import unicodedata
from functools import cache

from vrg.errors import ConfigError

NAME_RULE = "expected 1 to 64 letters, digits, _ and -, beginning with a letter or digit and not with x--"
_NAME_LENGTH = 64
_CODED = "x--"


def is_name(text: str) -> bool:
    """True if a text can be a name; see NAME_RULE. Letters of every language are letters."""
    if not 1 <= len(text) <= _NAME_LENGTH or not text[0].isalnum() or text.startswith(_CODED):
        return False
    # Some languages write marks over or under their letters.
    return text == normal(text) and all(c.isalnum() or c in "_-" or unicodedata.category(c)[0] == "M" for c in text)


def normal(text: str) -> str:
    """A name as it is compared: a letter with a mark is one character, whatever keyboard has typed it."""
    return unicodedata.normalize("NFC", text)


def check_name(name: str, what: str = "name") -> str:
    """Return a name.

    Raises:
        ConfigError: it is not one.
    """
    if not is_name(name):
        raise ConfigError(f"{what}: {NAME_RULE}, got {name!r}")
    return name


@cache
def chunk_of(name: str) -> str:
    """The part of a key that stands for a name; `*` stands for all."""
    return name if name.isascii() else _CODED + name.encode("punycode").decode("ascii")


@cache
def name_of(chunk: str) -> str:
    """The name that a part of a key stands for; the part itself where it is no code."""
    if not chunk.startswith(_CODED):
        return chunk
    try:
        name = chunk.removeprefix(_CODED).encode("ascii").decode("punycode")
        name.encode()  # half a pair of surrogates is no text
        return name or chunk  # the mark alone stands for no name
    except UnicodeError:
        return chunk
