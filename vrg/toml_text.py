"""TOML as text: on which line a field stands, which neither tomllib nor pydantic knows, and other values for some."""

import re
import tomllib
from collections.abc import Sequence

Path = tuple[str | int, ...]

_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"^\s*((?:[A-Za-z0-9_-]+|\"[^\"]*\"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|\"[^\"]*\"))*)\s*=")


def lines_of(text: str) -> dict[Path, int]:
    """The line, from 1, of every table and key; items of an array of tables are numbered from 0."""
    found: dict[Path, int] = {(): 1}
    counts: dict[Path, int] = {}
    table: Path = ()
    for number, line in enumerate(text.splitlines(), 1):
        header = _TABLE.match(line)
        if header:
            name = _parts(header[2])
            if header[1] == "[[":
                counts[name] = counts.get(name, -1) + 1
                table = (*name, counts[name])
            else:
                table = name
            found.setdefault(table, number)
            found.setdefault(name, number)
            continue
        key = _KEY.match(line)
        if key:
            found.setdefault((*table, *_parts(key[1])), number)
    return found


def line_of(lines: dict[Path, int], path: Sequence[str | int]) -> int:
    """The line of a field, or of the nearest table around it where the field is missing."""
    wanted = tuple(path)
    while wanted not in lines:
        wanted = wanted[:-1]
    return lines[wanted]


def syntax_error_line(error: tomllib.TOMLDecodeError) -> int:
    """The line that a parser's message names, 1 where it names none."""
    match = re.search(r"line (\d+)", str(error))
    return int(match[1]) if match else 1


def _parts(dotted: str) -> Path:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))


def with_values(text: str, values: dict[str, str | int | float | bool]) -> str:
    """The same file with other values of top-level fields."""
    lines = text.splitlines()
    known = lines_of(text)
    fresh = []
    for key, value in values.items():
        written = f"{key} = {_toml(value)}"
        if (key,) in known:
            lines[known[(key,)] - 1] = written
        else:
            fresh.append(written)
    return "\n".join([*fresh, *lines]) + "\n"


def _toml(value: str | float | bool) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else repr(value)
