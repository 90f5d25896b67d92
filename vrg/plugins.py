"""What plug-ins add besides games, robots and the like: commands, options of VRG's own, checks. See docs/plugins.md."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from msgspec import Struct

from vrg.errors import ConfigError
from vrg.registry import Registry, added, imported, installed_by


@dataclass(frozen=True)
class Command:
    """A command of a package outside. The module that holds it is imported for each help page, so it is a light one.

    Args:
        path: the words that are typed after `vrg`, such as `("run", "export")`. The last one is the command's own.
        heading: the heading of the help page below which it is listed.
        about: what it does, in one line.
        target: the `module:object` of a function, of a `typer.Typer`, or of a table of commands as in `vrg.cli`.
    """

    path: tuple[str, ...]
    heading: str
    about: str
    target: str


class Finding(Struct, frozen=True):
    """The result of one check.

    Args:
        what: the name of what was checked. text: the result in words.
        good: True or False for what VRG needs; None for what is only good to know.
    """

    what: str
    good: bool | None
    text: str


@dataclass(frozen=True)
class Option:
    """An option without a value that a view or a drawer adds to `vrg play`.

    Args:
        name: as it is typed, such as `--scoreboard`. about: its line of the help page.

    Raises:
        ValueError: nobody can type this name.
    """

    name: str
    about: str

    def __post_init__(self) -> None:
        if not re.fullmatch(r"--[a-z0-9]+(-[a-z0-9]+)*", self.name):
            raise ValueError(f"expected the name of an option, such as --scoreboard, got {self.name!r}")


def _check(found: object) -> str | None:
    good = isinstance(found, Command) and isinstance(found.path, tuple) and bool(found.path)
    if good and isinstance(found, Command):
        good = all(isinstance(text, str) for text in (*found.path, found.heading, found.about, found.target))
    return None if good else "expected a vrg.plugins.Command of strings, with a tuple of words as its path"


COMMANDS: Final[Registry[Command]] = Registry("command", "vrg.commands", {}, _check)
"""Every command of other packages; the name of an entry point is the command's path, joined by dots."""

CHECKS: Final[Registry[Callable[[], Finding]]] = Registry(
    "check", "vrg.checks", {}, lambda found: None if callable(found) else "expected a function"
)
"""Every check that other packages add to `vrg doctor`: a function that returns a `Finding`."""


def commands_below(path: Sequence[str]) -> Iterator[Command]:
    """The commands that other packages add to the group with this path; what cannot be imported is left out."""
    for name in COMMANDS.names():
        if name.split(".")[:-1] == [*path] and (found := COMMANDS.find(name)) and ".".join(found.path) == name:
            yield found


def command_at(path: Sequence[str]) -> Command | None:
    """The command that another package adds at this path; None where none does.

    Raises:
        ConfigError: it cannot be imported, or has another path than its entry point.
    """
    name = ".".join(path)
    if name not in COMMANDS:
        return None
    found = COMMANDS.get(name)
    if found.path != tuple(path):
        raise ConfigError(f"command {name}: expected this path, got {'.'.join(found.path)}")
    return found


def broken() -> Iterator[tuple[str, str]]:
    """The entry points of other packages that cannot be used: the package with the name, and why, in words."""
    for group, entry in ((name, entry) for name, entries in added().items() for entry in entries.values()):
        try:
            imported(entry.load, f"cannot import {entry.value} of the entry point group {group}")
            if group == COMMANDS.group:
                command_at(entry.name.split("."))
        except ConfigError as error:
            yield entry.name, str(error)


def where_from(path: Sequence[str]) -> str | None:
    """How to get a command that a plug-in of VRG adds, in words, where it is not installed; None for any other."""
    name = ".".join(path)
    return None if name in COMMANDS else installed_by(COMMANDS.group, name)
