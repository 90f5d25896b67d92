"""Options that other packages add to commands of VRG: for their views, and for their drawers of the page."""

from collections.abc import Iterator
from dataclasses import field, fields, make_dataclass
from typing import Annotated, Any, Final, NamedTuple, TypeVar

import typer
from typer.core import TyperCommand
from typer.models import OptionInfo

from vrg.plugins import Option
from vrg.registry import installed_by

T = TypeVar("T")
_ADDED: Final = "added"
"""In the metadata of a field, the Added that it is made of."""


class Added(NamedTuple):
    """An option, and what it opens: the view with this name in `vrg show`, or the drawer of the page with this name."""

    option: Option
    view: str = ""
    drawer: str = ""


def added_views(use: str = "opens") -> Iterator[Added]:
    """The options of views.

    Args:
        use: the field of their kinds with the function that is wanted, `opens` or `replays`.
    """
    from vrg.kinds import every_kind

    for kind in every_kind():
        if kind.option and kind.shown and getattr(kind, use):
            yield Added(kind.option, view=kind.shown)


def added_drawers() -> Iterator[Added]:
    """The options of drawers of the page."""
    from vrg.ui.web.drawers import DRAWERS

    for name in DRAWERS.names():
        if (drawer := DRAWERS.find(name)) and drawer.option:
            yield Added(drawer.option, drawer=name)


def extended(options: type[T], names: set[str]) -> type[T]:
    """The dataclass of options with those that packages add, which its method `added` returns; itself if it has none.

    Args:
        names: of the command's options so far. One that would take the place of another is left out.
    """
    more: list[tuple[str, Any, Any]] = []
    for added in getattr(options, "added", tuple)():
        if added.option.name not in names:
            names.add(added.option.name)
            kind = Annotated[bool, typer.Option(added.option.name, help=added.option.about)]
            more.append((f"added_{len(more)}", kind, field(default=False, metadata={_ADDED: added})))
    return make_dataclass(options.__name__, more, bases=(options,), frozen=True) if more else options


def typed(options: Any) -> list[Added]:
    """Those of the added options that were typed."""
    return [one.metadata[_ADDED] for one in fields(options) if _ADDED in one.metadata and getattr(options, one.name)]


def names_of(name: str, kind: Any) -> set[str]:
    """The names, such as `--seed`, of the option that a parameter of a command is, by its name and its annotation."""
    for info in getattr(kind, "__metadata__", ()):
        if isinstance(info, OptionInfo) and info.param_decls:
            return {each for words in info.param_decls for each in words.split("/")}
    word = name.replace("_", "-")
    return {f"--{word}", f"--no-{word}"}


class Extended(TyperCommand):
    """A command to which packages may add options. It tells how to get one of a plug-in of VRG that is missing."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse what was typed after the command."""
        known = {name for parameter in self.params for name in (*parameter.opts, *parameter.secondary_opts)}
        command = f"vrg{ctx.command_path.removeprefix(ctx.find_root().command_path)}"
        for name in (word.partition("=")[0] for word in args if word.startswith("--")):
            if name not in known and (wanted := installed_by(command, name)):
                ctx.fail(f"{name} is an option that {wanted}")
        return super().parse_args(ctx, args)
