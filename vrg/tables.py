"""The common base of the models of all TOML files that people write, and the lines of the fields of such a file."""

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path as FilePath
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, get_args

import msgspec
from pydantic import BaseModel, BeforeValidator, ConfigDict, InstanceOf, ValidationError

from vrg.errors import ConfigError, Path, Problem
from vrg.files import toml_of
from vrg.regions import Circle, Polygon, Rectangle, Region, Sector
from vrg.registry import did_you_mean


class Table(BaseModel):
    """The base class of the tables of a TOML file. It refuses unknown fields, NaN and infinity, and is frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _region(value: object) -> object:
    if isinstance(value, Mapping):
        shaped = {"shape": "rectangle", **value}
        for angle in ("start", "sweep"):
            if isinstance(shaped.get(angle), int | float):
                shaped[angle] = math.radians(shaped[angle])
        try:
            return msgspec.convert(shaped, Region, strict=False)
        except msgspec.ValidationError as error:
            raise ValueError(str(error)) from None
    return value


RegionSetting = Annotated[
    InstanceOf[Rectangle] | InstanceOf[Circle] | InstanceOf[Sector] | InstanceOf[Polygon], BeforeValidator(_region)
]
"""A region as people write it, for example `{ shape = "circle", x = 0.0, y = 0.0, radius = 0.6 }`. Without a shape it
is a rectangle. People write the angles of a sector in degrees."""


def problems_of(
    error: ValidationError,
    prefix: Path = (),
    fields: Iterable[str] = (),
    lists: Mapping[str, Iterable[str]] = MappingProxyType({}),
) -> list[Problem]:
    """Convert the errors that pydantic has found into problems, in the words of this project.

    Args:
        prefix: the path in the file of the table that was checked. fields: the names of its fields, to guess at the one
            that was meant by a field that is not known. lists: those of the tables of its lists of tables, by name.
    """
    found = []
    for detail in error.errors():
        place = detail["loc"]
        known = fields if len(place) == 1 else lists.get(str(place[0]), ()) if len(place) == 3 else ()
        guess = did_you_mean(str(place[-1]), known) if detail["type"] == "extra_forbidden" else ""
        found.append(Problem(_words(detail) + guess, (*prefix, *place)))
    return found


def problems_in(error: ValidationError, kind: type[BaseModel], prefix: Path = ()) -> list[Problem]:
    """The problems of a table of a kind, with guesses at unknown fields of it and of its lists and dictionaries of
    tables, such as robots; see `problems_of`."""
    lists: dict[str, Iterable[str]] = {}
    for name, field in kind.model_fields.items():
        inner = next(reversed(get_args(field.annotation)), None)
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            lists[name] = inner.model_fields
    return problems_of(error, prefix, kind.model_fields, lists)


_EXPECTED = {
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than": "less than {lt:g}",
    "less_than_equal": "at most {le:g}",
    "too_short": "at least {min_length} of them",
    "too_long": "at most {max_length} of them",
    "finite_number": "a finite number",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "literal_error": "{expected}",
}
"""The expected kind of value, by pydantic's name of the mistake."""


def _words(detail: Any) -> str:
    """A mistake that pydantic has found: what was expected, and what was found."""
    if detail["type"] == "extra_forbidden":
        return "unknown field"
    if detail["type"] == "missing":
        return "missing"
    if detail["type"] == "list_type" and isinstance(detail["input"], dict):
        return f"expected any number of tables, got one: write [[{detail['loc'][-1]}]] with two brackets"
    expected = _EXPECTED.get(detail["type"])
    if expected is None:
        return str(detail["msg"]).removeprefix("Value error, ")
    return f"expected {expected.format(**detail.get('ctx', {}))}, got {detail['input']!r}"


class Statement(NamedTuple):
    """A header or a field in the text of a TOML file.

    Args:
        first, end: its lines from `first` on and before `end`, counted from 0.
        table: the path of the table that it belongs to; of a header, the table that it begins.
        paths: the paths of all that it defines, from the outside to the inside. header: True if it is a header.
    """

    first: int
    end: int
    table: Path
    paths: Sequence[Path]
    header: bool


def statements_of(text: str) -> Iterator[Statement]:
    """The statements of a file in its order. The items of arrays of tables are numbered from 0 in the paths."""
    counts: dict[Path, int] = {}
    table: Path = ()
    begun: list[str] = []
    for end, line in enumerate(text.split("\n"), 1):
        begun.append(line)
        try:
            data = tomllib.loads("\n".join([*begun, ""]))
        except tomllib.TOMLDecodeError:
            # It goes on in the next line.
            continue
        if begun[0].lstrip().startswith("["):
            paths = _header(data, counts)
            table = paths[-1]
            yield Statement(end - len(begun), end, table, paths, True)
        elif data:
            yield Statement(end - len(begun), end, table, [(*table, *path) for path in _paths(data)], False)
        begun = []


def _header(data: Any, counts: dict[Path, int]) -> list[Path]:
    """The paths of a header that stands alone in `data`, where `counts` has the newest item of each array of tables."""
    path: Path = ()
    paths = []
    while data:
        ((key, data),) = data.items()
        path = (*path, key)
        paths.append(path)
        if isinstance(data, list):
            counts[path] = counts.get(path, -1) + 1
            data = {}
        if path in counts:
            path = (*path, counts[path])
            paths.append(path)
    return paths


def _paths(value: object) -> Iterator[Path]:
    """The paths of all that a value holds."""
    inner: Any = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, one in inner:
        yield (key,)
        yield from ((key, *path) for path in _paths(one))


def lines_of(text: str) -> dict[Path, int]:
    """The line, from 1, of every table and field. What stands inside a value has the line where that begins."""
    found: dict[Path, int] = {(): 1}
    for statement in statements_of(text):
        for path in statement.paths:
            found.setdefault(path, statement.first + 1)
    return found


def parsed(text: str, file: FilePath | str) -> dict[str, Any]:
    """Return what the text of a TOML file holds.

    Raises:
        ConfigError: it is no TOML; with its line.
    """
    try:
        return toml_of(text)
    except tomllib.TOMLDecodeError as error:
        line, twice = re.search(r"line (\d+)", str(error)), re.search(r"declare \('(\w+)',\) twice", str(error))
        advice = f": write [[{twice[1]}]] for each of several tables" if twice else ""
        raise ConfigError([Problem(f"not TOML: {error}{advice}", (), str(file), int(line[1]) if line else 1)]) from None


def located(problems: Iterable[Problem], file: FilePath | str, text: str) -> list[Problem]:
    """Return problems with their places in the text of a file, in its order.

    A field that is missing has the line of the nearest table around it. A problem that has a file already keeps it.
    """
    lines, found = lines_of(text), set[Problem]()
    for problem in problems:
        path = problem.path
        while path not in lines:
            path = path[:-1]
        found.add(problem if problem.file is not None else Problem(problem.text, problem.path, str(file), lines[path]))
    return sorted(found, key=lambda problem: (problem.line or 0, str(problem)))
