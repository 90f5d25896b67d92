"""What the models of all TOML files that people write have in common."""

import math
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Annotated, Any

import msgspec
from pydantic import BaseModel, BeforeValidator, ConfigDict, InstanceOf, ValidationError

from vrg.errors import Path, Problem
from vrg.regions import Circle, Polygon, Rectangle, Region, Sector
from vrg.registry import Registry
from vrg.toml_text import line_of


class Table(BaseModel):
    """The base class of the tables of a TOML file. It refuses unknown fields, NaN and infinity, and is frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def known_in(value: str, registry: "Registry[Any]") -> str:
    """Return the value, if a registry has that name.

    Raises:
        ValueError: it has not; the message lists the names and guesses the one that was meant.
    """
    if value not in registry:
        raise ValueError(registry.expected(value))
    return value


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


def problems_of(error: ValidationError, prefix: Path = ()) -> list[Problem]:
    """Convert the errors that pydantic has found into problems, in the words of this project.

    Args:
        prefix: the path in the file of the table that was checked.
    """
    return [Problem(_words(detail), (*prefix, *detail["loc"])) for detail in error.errors()]


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
"""What was expected, by pydantic's name of the mistake."""


def _words(detail: Any) -> str:
    """A mistake that pydantic has found: what was expected, and what came."""
    if detail["type"] == "extra_forbidden":
        return "unknown field"
    if detail["type"] == "missing":
        return "missing"
    expected = _EXPECTED.get(detail["type"])
    if expected is None:
        return str(detail["msg"]).removeprefix("Value error, ")
    return f"expected {expected.format(**detail.get('ctx', {}))}, got {detail['input']!r}"


def located(problem: Problem, file: FilePath | str, lines: Mapping[Path, int]) -> Problem:
    """Return a problem with its place in a file. A problem that has a file already stays as it is."""
    if problem.file is not None:
        return problem
    return Problem(problem.text, problem.path, str(file), line_of(dict(lines), problem.path))
