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
    """Return a problem with its place in a file. A problem that has a file already stays as it is."""
    if problem.file is not None:
        return problem
    return Problem(problem.text, problem.path, str(file), line_of(dict(lines), problem.path))
