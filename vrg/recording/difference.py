"""The first difference between two recordings of one match."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import msgspec

from vrg.errors import FileError, MessageError
from vrg.files import decoded
from vrg.recording.mcap_reading import records_in

_LENGTH = 60
"""The length of the longest value that is shown, characters."""


@dataclass(frozen=True)
class Difference:
    """The first difference between two recordings of one match.

    Args:
        time: the match time, s. topic: what was published, such as `/robot/ann/drive`.
        field: the place in it, such as `twist.v`; empty for all of it.
        values: both values there, in words.
    """

    time: float
    topic: str
    field: str
    values: tuple[str, str]

    def __str__(self) -> str:
        field = f", {self.field}" if self.field else ""
        return f"at {self.time:.3f} s, {self.topic}{field}: {self.values[0]} there, {self.values[1]} here"


def first_difference(there: Sequence[Path], here: Sequence[Path], torn: list[Path]) -> Difference | None:
    """The first message in which two recordings differ; None if there is none, as far as both go.

    Args:
        there, here: the parts of each, in their order. torn: where to note the parts that are torn or damaged.

    Raises:
        OSError: a file cannot be read.
        MessageError: it is not a recording of this program.
    """
    for one, other in zip_longest(records_in(there, torn), records_in(here, torn)):
        if one is None or other is None:
            if torn:
                return None
            topic, time, _ = one or other
            words = ("nothing more", "one more record")
            return Difference(time, topic, "", words if one is None else words[::-1])
        if one[:2] != other[:2]:
            first = min(one, other, key=lambda record: record[1])
            return Difference(first[1], first[0], "", (_named(one), _named(other)))
        if one[2] != other[2]:
            found = next(_fields(*(_read(data, one[0]) for data in (one[2], other[2]))), None)
            # Texts may differ where values do not, as those of 0 and -0.
            field, *values = found or ("", *(data.decode(errors="replace") for data in (one[2], other[2])))
            return Difference(one[1], one[0], field, (_shown(values[0]), _shown(values[1])))
    return None


def _read(data: bytes, topic: str) -> Any:
    """What a record holds.

    Raises:
        MessageError: it is no JSON.
    """
    try:
        return decoded(msgspec.json.Decoder(), data)
    except FileError as error:
        raise MessageError(f"{topic}: expected JSON: {error}") from None


def _named(record: tuple[str, float, bytes]) -> str:
    return f"{record[0]} of {record[1]:.3f} s"


def _fields(one: Any, other: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    """The places in which two decoded records differ, with both values."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in (*one, *(name for name in other if name not in one)):
            yield from _fields(one.get(name), other.get(name), f"{place}.{name}".lstrip("."))
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, pair in enumerate(zip(one, other, strict=True)):
            yield from _fields(*pair, f"{place}[{number}]")
    elif one != other:
        yield place, one, other


def _shown(value: Any) -> str:
    text = msgspec.json.encode(value).decode()
    return text if len(text) <= _LENGTH else f"{text[: _LENGTH - 3]}..."
