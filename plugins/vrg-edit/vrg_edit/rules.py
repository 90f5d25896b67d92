"""The fields of a game's [rules] table, with their defaults, bounds and words, as its settings class has them."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from inspect import getdoc
from typing import Any, Final, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from vrg.errors import Path, VrgError
from vrg.games import GAMES
from vrg.tables import Table
from vrg_edit.draft import shown

_BOUNDS: Final = {"gt": "more than {:g}", "ge": "at least {:g}", "lt": "less than {:g}", "le": "at most {:g}"}
"""Bounds in words, by pydantic's names of them."""


@dataclass(frozen=True)
class Rule:
    """One field of a [rules] table.

    Args:
        path: its place in a match file. default: as a person types it; empty if there is none, or the rules decide.
        choices: what it can be; empty if anything can be typed. bounds: of a number, in words.
        help: what it means, from the docstring of its class.
    """

    path: Path
    default: str
    choices: tuple[str, ...]
    bounds: str
    help: str


def rules_of(game: str) -> tuple[Rule, ...]:
    """The fields of the [rules] table of a game, in the order of its settings class; none of an unknown game."""
    try:
        return tuple(_rules(GAMES.get(game).load_settings(), ("rules",), None))
    except VrgError:
        return ()


def _rules(kind: type[Table], above: Path, defaults: object) -> list[Rule]:
    found, help_ = [], _help(kind)
    # The fields of the class itself come before those that it has from others.
    own = [name for name in kind.model_fields if name in kind.__annotations__]
    for name in dict.fromkeys((*own, *kind.model_fields)):
        field = kind.model_fields[name]
        default = field.get_default() if defaults is None else getattr(defaults, name)
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, Table):
            found += _rules(inner, (*above, name), default if isinstance(default, inner) else None)
            continue
        choices = get_args(inner) if get_origin(inner) is Literal else ("true", "false") if inner is bool else ()
        text = "" if field.is_required() and defaults is None else shown(default)
        found.append(Rule((*above, name), text, tuple(map(str, choices)), _bounds(field), help_.get(name, "")))
    return found


def _bounds(field: FieldInfo) -> str:
    known: list[Any] = field.metadata
    return ", ".join(
        words.format(bound)
        for name, words in _BOUNDS.items()
        for one in known
        if (bound := getattr(one, name, None)) is not None
    )


def _help(kind: type[Table]) -> Mapping[str, str]:
    """The descriptions of the fields in the docstrings of a class and of its bases."""
    found: dict[str, str] = {}
    for one in reversed([one for one in kind.__mro__ if issubclass(one, Table)]):
        _, _, args = (getdoc(one) or "").partition("Args:")
        fields = "|".join(map(re.escape, kind.model_fields))
        parts = re.split(rf"(?:^|(?<=[.\s]))((?:(?:{fields}), )*(?:{fields})): ", " ".join(args.split()))
        for names, words in zip(parts[1::2], parts[2::2], strict=True):
            found |= dict.fromkeys(names.split(", "), words.strip())
    return found
