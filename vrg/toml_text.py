"""TOML as text: the line of each field, which neither tomllib nor pydantic tells, and the replacement of values."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence

from vrg.errors import Path

TomlValue = str | int | float | bool
"""A value that is written into a file."""

_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"^\s*((?:[A-Za-z0-9_-]+|\"[^\"]*\"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|\"[^\"]*\"))*)\s*=")
_TOKEN = re.compile(r'"""|\'\'\'|\\.|["\'#\[\]{}]')


def lines_of(text: str) -> dict[Path, int]:
    """The line, from 1, of every table and key. The items of an array of tables are numbered from 0 in the paths."""
    found: dict[Path, int] = {(): 1}
    for number, path, header in _places(text):
        found.setdefault(path, number)
        if header and path and isinstance(path[-1], int):
            found.setdefault(path[:-1], number)
    return found


def _places(text: str) -> Iterator[tuple[int, Path, bool]]:
    """The line of each table and key in the order of the file, its path, and whether it is the header of a table."""
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
            yield number, table, True
            continue
        key = _KEY.match(line)
        if key:
            yield number, (*table, *_parts(key[1])), False


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
        depth, quote, _ = _scan(line, depth, quote)


def _scan(line: str, depth: int, quote: str) -> tuple[int, str, int | None]:
    """How many brackets and which quotation mark are open after a line, and where in it a comment begins."""
    comment = None
    for token in _TOKEN.finditer(line):
        sign = token[0]
        if quote:
            # In a literal string a backslash does not escape the quotation mark.
            if sign == quote or (quote[0] == sign[-1] == "'" and len(quote) == 1):
                quote = ""
        elif sign == "#":
            comment = token.start()
            break
        elif sign in ('"""', "'''", '"', "'"):
            quote = sign
        elif sign in "[{":
            depth += 1
        elif sign in "]}":
            depth = max(0, depth - 1)
    # Only strings in triple quotation marks may go on in the next line.
    return depth, quote if len(quote) == 3 else "", comment


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


def with_values(text: str, values: Mapping[str, TomlValue]) -> str:
    """Return the text of the file with other values of top-level fields; new ones stand below those that are there."""
    for key, value in values.items():
        text = with_value_in(text, (), key, value)
    return text


def with_value_in(text: str, table: Path, key: str, value: TomlValue) -> str:
    """Return the text of the file with another value of one field of a table. Comments stay where they are.

    Args:
        table: the path of the table, such as `("players", 2)`, which must have a header of its own; empty for the
            fields at the top of the file.

    Raises:
        ValueError: the table has no header of its own.
    """
    lines, known = text.splitlines(), lines_of(text)
    written = f"{key} = {_toml(value)}"
    start = known.get((*table, key))
    if start is not None:
        end = _last_line(lines, start)
        lines[start - 1 : end] = [_beside(written, lines[end - 1], lines[start - 1 : end - 1])]
    elif not table:
        at_top = [number for number, path, header in _places(text) if len(path) == 1 and not header]
        lines.insert(_last_line(lines, at_top[-1]) if at_top else 0, written)
    elif table in known:
        lines.insert(known[table], written)
    else:
        raise ValueError(_headless(table))
    return "\n".join(lines) + "\n"


def without_value_in(text: str, table: Path, key: str) -> str:
    """Return the text of the file without one field of a table. A field that is not there changes nothing."""
    lines, known = text.splitlines(), lines_of(text)
    start = known.get((*table, key))
    if start is not None:
        del lines[start - 1 : _last_line(lines, start)]
    return "\n".join(lines) + "\n"


def with_item(text: str, array: str, item: Mapping[str, TomlValue]) -> str:
    """Return the text of the file with one more table at the end of an array of tables, such as [[players]]."""
    lines = text.splitlines()
    count = sum(header and len(path) == 2 and path[0] == array for _, path, header in _places(text))
    end = _span(text, (array, count - 1))[1] if count else len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    lines[end:end] = ["", f"[[{array}]]", *(f"{key} = {_toml(value)}" for key, value in item.items())]
    return "\n".join(lines) + "\n"


def without_item(text: str, path: Path) -> str:
    """Return the text of the file without a table of an array, such as `("players", 2)`, and the tables below it.

    Raises:
        ValueError: the table has no header of its own.
    """
    lines = text.splitlines()
    start, end = _span(text, path)
    del lines[start:end]
    return "\n".join(lines) + "\n"


def _span(text: str, path: Path) -> tuple[int, int]:
    """The lines of a table with its comments and the tables below it: the first, from 0, and the one after the last."""
    lines = text.splitlines()
    headers = [(number, name) for number, name, header in _places(text) if header]
    first = next((index for index, (_, name) in enumerate(headers) if name == path), None)
    if first is None:
        raise ValueError(_headless(path))
    after = next((number for number, name in headers[first + 1 :] if name[: len(path)] != path), len(lines) + 1)
    return _with_comments(lines, headers[first][0]), _with_comments(lines, after)


def _with_comments(lines: Sequence[str], header: int) -> int:
    """The first line, from 0, of the comments right above a header, whose line is counted from 1."""
    first = header - 1
    while first and lines[first - 1].lstrip().startswith("#"):
        first -= 1
    return first


def _headless(table: Path) -> str:
    return f"expected a table {'.'.join(map(str, table))} with a header of its own, such as [[{table[0]}]]"


def _last_line(lines: Sequence[str], start: int) -> int:
    """The last line of a value that begins in the line `start`; both count from 1."""
    depth, quote, number = 0, "", start - 1
    while number < len(lines):
        depth, quote, _ = _scan(lines[number], depth, quote)
        number += 1
        if not (depth or quote):
            break
    return number


def _beside(written: str, line: str, above: Sequence[str]) -> str:
    """A new value with the comment that stood behind the old one, whose last line is `line`."""
    depth, quote = 0, ""
    for one in above:
        depth, quote, _ = _scan(one, depth, quote)
    comment = _scan(line, depth, quote)[2]
    return written if comment is None else f"{written.ljust(comment - 1)} {line[comment:]}"


def quoted(text: str) -> str:
    """A text as a TOML string, which has the same escapes as one of JSON."""
    return json.dumps(text, ensure_ascii=False)


def _toml(value: TomlValue) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return quoted(value) if isinstance(value, str) else repr(value)
