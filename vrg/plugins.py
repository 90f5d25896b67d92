"""What plug-ins add besides games, robots and the like: commands, and checks of `vrg doctor`. See docs/plugins.md."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from vrg.registry import Registry, installed_by

if TYPE_CHECKING:
    from vrg.launch.findings import Finding


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


COMMANDS: Final[Registry[Command]] = Registry(
    "command",
    "vrg.commands",
    {},
    lambda found: None if isinstance(found, Command) else "expected a vrg.plugins.Command",
)
"""Every command of other packages; the name of an entry point is the command's path, joined by dots."""

CHECKS: Final[Registry[Callable[[], "Finding"]]] = Registry(
    "check", "vrg.checks", {}, lambda found: None if callable(found) else "expected a function"
)
"""Every check that other packages add to `vrg doctor`: a function that returns a `vrg.launch.findings.Finding`."""


CALIBRATIONS: Final[Registry[Callable[..., None]]] = Registry("way to calibrate", "vrg.calibrations", {})
"""The ways to calibrate a robot with motors on a CAN bus without a tape measure, with the parameters of
`vrg can calibrate`: its player, the match file, the file to write, speed, way, seconds, in_process."""


def commands_below(path: Sequence[str]) -> Iterator[Command]:
    """The commands that other packages add to the group with this path; what cannot be imported is left out."""
    for name in COMMANDS.names():
        if (found := COMMANDS.find(name)) is not None and found.path[:-1] == tuple(path):
            yield found


def where_from(path: Sequence[str]) -> str | None:
    """How to get a command that a plug-in of VRG adds, in words, where it is not installed; None for any other."""
    name = ".".join(path)
    return None if name in COMMANDS else installed_by(COMMANDS.group, name)
