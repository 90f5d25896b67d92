"""What the models of all files that people write have in common."""

from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Annotated, Any

import msgspec
from pydantic import BaseModel, BeforeValidator, ConfigDict, InstanceOf, ValidationError

from vrg.errors import Path, Problem
from vrg.regions import Circle, Polygon, Rectangle, Region, Sector
from vrg.registry import Registry
from vrg.toml_text import line_of


class Table(BaseModel):
    """A table of a TOML file: no field that is unknown, no number that is none, nothing that changes."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def one_of(value: str, known: Sequence[str]) -> str:
    """The value, if it is one of those known.

    Raises:
        ValueError: it is not; lists them.
    """
    if value not in known:
        raise ValueError(f"expected one of {', '.join(known)}, got {value!r}")
    return value


def known_in(value: str, registry: "Registry[Any]") -> str:
    """The value, if a registry has that name.

    Raises:
        ValueError: it does not; lists the names and guesses.
    """
    if value not in registry:
        raise ValueError(registry.unknown(value).partition(": ")[2])
    return value


def _region(value: object) -> object:
    if isinstance(value, Mapping):
        shaped = value if "shape" in value else {"shape": "rectangle", **value}
        try:
            return msgspec.convert(shaped, Region, strict=False)
        except msgspec.ValidationError as error:
            raise ValueError(str(error)) from None
    return value


RegionSetting = Annotated[
    InstanceOf[Rectangle] | InstanceOf[Circle] | InstanceOf[Sector] | InstanceOf[Polygon], BeforeValidator(_region)
]
"""A region as people write it, for example `{ shape = "circle", x = 0.0, y = 0.0, radius = 0.6 }`; without a shape it is
a rectangle. Angles are radians."""


def problems_of(error: ValidationError, prefix: Path = ()) -> list[Problem]:
    """What pydantic has found, in the words of this project.

    Args:
        prefix: where in the file the table stands that was checked.
    """
    problems = []
    for detail in error.errors():
        text = detail["msg"].removeprefix("Value error, ")
        if detail["type"] == "extra_forbidden":
            text = "unknown field"
        elif detail["type"] == "missing":
            text = "missing"
        problems.append(Problem(text, (*prefix, *detail["loc"])))
    return problems


def located(problem: Problem, file: FilePath | str, lines: Mapping[Path, int]) -> Problem:
    """A problem with its place in a file, unless it already has one: it may be about another file."""
    if problem.file is not None:
        return problem
    return Problem(problem.text, problem.path, str(file), line_of(dict(lines), problem.path))
