"""TOML as text: the line of each field, which neither tomllib nor pydantic tells, and the replacement of values."""

import json
import re
import tomllib
from collections.abc import Iterator, Sequence

from vrg.errors import Path

_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"^\s*((?:[A-Za-z0-9_-]+|\"[^\"]*\"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|\"[^\"]*\"))*)\s*=")
_TOKEN = re.compile(r'"""|\'\'\'|\\.|["\'#\[\]{}]')


def lines_of(text: str) -> dict[Path, int]:
    """The line, from 1, of every table and key. The items of an array of tables are numbered from 0 in the paths."""
    found: dict[Path, int] = {(): 1}
    counts: dict[Path, int] = {}
    table: Path = ()
    for number, line in _fresh_lines(text):
        header = _TABLE.match(line)
        if header:
            *above, last = _parts(header[2])
            name = (*_numbered(above, counts), last)
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


def _numbered(parts: Sequence[str | int], counts: dict[Path, int]) -> Path:
    """The path of a table, with the number of the newest item behind the name of each array of tables in it."""
    path: Path = ()
    for part in parts:
        path = (*path, part)
        if path in counts:
            path = (*path, counts[path])
    return path


def _fresh_lines(text: str) -> Iterator[tuple[int, str]]:
    """The numbered lines that do not begin inside a value. A row of a long array could look like a table's header."""
    depth, quote = 0, ""
    for number, line in enumerate(text.splitlines(), 1):
        begins_value = not (depth or quote)
        if begins_value:
            yield number, line
        # The brackets of a table's header open and close on its own line, so they may be counted, too.
        depth, quote = _after(line, depth, quote)


def _after(line: str, depth: int, quote: str) -> tuple[int, str]:
    """How many brackets and which quotation mark are open after a line."""
    for token in _TOKEN.findall(line):
        if quote:
            # In a literal string a backslash does not escape the quotation mark.
            if token == quote or (quote[0] == token[-1] == "'" and len(quote) == 1):
                quote = ""
        elif token == "#":
            break
        elif token in ('"""', "'''", '"', "'"):
            quote = token
        elif token in "[{":
            depth += 1
        elif token in "]}":
            depth = max(0, depth - 1)
    # Only strings in triple quotation marks may go on in the next line.
    return depth, quote if len(quote) == 3 else ""


def line_of(lines: dict[Path, int], path: Sequence[str | int]) -> int:
    """The line of a field, or of the nearest table around it if the field is missing."""
    wanted = tuple(path)
    while wanted not in lines:
        wanted = wanted[:-1]
    return lines[wanted]


def syntax_error_line(error: tomllib.TOMLDecodeError) -> int:
    """The line that a parser's message names, or 1 if it names none."""
    match = re.search(r"line (\d+)", str(error))
    return int(match[1]) if match else 1


def _parts(dotted: str) -> Path:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))


def with_values(text: str, values: dict[str, str | int | float | bool]) -> str:
    """Return the text of the file with other values of top-level fields."""
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


def with_value_in(text: str, table: Path, key: str, value: str | float | bool) -> str:
    """Return the text of the file with another value of one field of a table.

    Args:
        table: the path of the table, such as `("players", 2)`. It must have a header of its own.

    Raises:
        ValueError: the table has no header of its own.
    """
    lines, known = text.splitlines(), lines_of(text)
    written = f"{key} = {_toml(value)}"
    if (*table, key) in known:
        lines[known[(*table, key)] - 1] = written
    elif table in known:
        lines.insert(known[table], written)
    else:
        raise ValueError(
            f"expected a table {'.'.join(map(str, table))} with a header of its own, such as [[{table[0]}]]"
        )
    return "\n".join(lines) + "\n"


def quoted(text: str) -> str:
    """A text as a TOML string, which has the same escapes as one of JSON."""
    return json.dumps(text, ensure_ascii=False)


def _toml(value: str | float | bool) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return quoted(value) if isinstance(value, str) else repr(value)
