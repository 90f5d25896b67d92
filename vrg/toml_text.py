"""Edits of TOML text that keep its comments and its order."""

from collections.abc import Mapping, MutableMapping, Sequence
from functools import reduce
from operator import getitem
from typing import Any

import tomlkit

from vrg.errors import Path
from vrg.tables import statements_of

TomlValue = str | int | float | bool | Sequence["TomlValue"] | Mapping[str, "TomlValue"]
"""A value that is written into a file."""


def with_value(text: str, path: Path, value: TomlValue) -> str:
    """Return the text of a file with another value of a field, or with a new field below the others of its table.

    Raises:
        KeyError: there is no such table. ValueError: it is no table, or the text is no TOML.
    """
    document: Any = tomlkit.parse(text)
    *above, key = path
    if isinstance(value, Mapping):
        inline = tomlkit.inline_table()
        inline.update(value)
        value = inline
    table = reduce(getitem, above, document)
    if not isinstance(table, MutableMapping):
        raise ValueError(f"expected a table {'.'.join(map(str, above))}, got {table!r}")
    if key not in table:
        ends = [statement.end for statement in statements_of(text) if statement.table == tuple(above)]
        if ends or not above:
            return _with_lines(text, max(ends, default=0), tomlkit.dumps({str(key): value}))
    table[key] = value
    return tomlkit.dumps(document)


def with_item(text: str, array: str, item: Mapping[str, TomlValue]) -> str:
    """Return the text of a file with one more table at the end of an array of tables, such as [[players]].

    Raises:
        ValueError: the text is no TOML.
    """
    document = tomlkit.parse(text)
    headers = [s.table for s in statements_of(text) if s.header and len(s.table) == 2 and s.table[0] == array]
    if array in document and not headers:
        inline = tomlkit.inline_table()
        inline.update(item)
        document[array].append(inline)
        return tomlkit.dumps(document)
    lines = text.split("\n")
    end = _span(text, headers[-1])[1] if headers else len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    return _with_lines(text, end, "\n" + tomlkit.dumps({array: [dict(item)]}))


def without(text: str, path: Path) -> str:
    """Return the text of a file without a field, or without a table, the comments above it, and the tables below it.

    What is not there changes nothing.

    Raises:
        ValueError: the text is no TOML.
    """
    if any(statement.header and statement.table == path for statement in statements_of(text)):
        lines = text.split("\n")
        start, end = _span(text, path)
        return "\n".join([*lines[:start], *lines[end:]])
    document: Any = tomlkit.parse(text)
    *above, key = path
    try:
        del reduce(getitem, above, document)[key]
    except (LookupError, TypeError):  # what is above it may be no table
        return text
    return tomlkit.dumps(document)


def _with_lines(text: str, before: int, added: str) -> str:
    """The text with more lines before a line that is counted from 0."""
    lines = text.split("\n")
    lines.insert(before, added.removesuffix("\n"))
    return "\n".join(lines)


def _span(text: str, path: Path) -> tuple[int, int]:
    """The lines of a table with its comments and the tables below it: the first, from 0, and the one after the last."""
    lines = text.split("\n")
    headers = [statement for statement in statements_of(text) if statement.header]
    first = next(index for index, statement in enumerate(headers) if statement.table == path)
    after = next((s.first for s in headers[first + 1 :] if s.table[: len(path)] != path), len(lines))
    return _above(lines, headers[first].first), _above(lines, after)


def _above(lines: Sequence[str], header: int) -> int:
    """The first line of the comments right above a header; both are counted from 0."""
    while header and lines[header - 1].lstrip().startswith("#"):
        header -= 1
    return header


def quoted(text: str) -> str:
    """A text as a TOML string."""
    return tomlkit.item(text).as_string()
