"""The `vrg` command. Its exit status is 0 for success, 1 for failure, 2 for wrong usage, and 130 if interrupted.

The module of a command is imported only if that command is asked for, so that a command such as `vrg official halt`
does not wait for physics to load. The help texts of the groups below are here, so that they need no module at all.
"""

import os
import sys
from collections.abc import Callable, Mapping
from functools import partial
from io import TextIOWrapper
from typing import Annotated, Any, ClassVar, Final

import typer
from typer.core import TyperGroup

from vrg import __version__
from vrg.errors import ConfigError, VrgError
from vrg.registry import close_to, imported, load_object
from vrg.types import printable

# Without this, a line that pygame prints on import would be the first line of every command.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

WITHOUT_COMMAND: Final = "edit"
"""The command that `vrg` alone runs at a terminal, if a package adds it."""

Table = Mapping[str, Mapping[str, tuple[Any, str]]]
"""The headings of a help page; below each, the commands with what they are, and what they do in a line.

A command is the `module:object` of a function or of a group, or the table of a further group. A function returns
either when it is asked for.
"""


def _nodes() -> Table:
    """A command for each kind of process."""
    from vrg.kinds import KINDS, every_kind  # noqa: PLC0415 - most commands run no process

    about = {kind.name: _sentence(kind.about) for kind in every_kind()}
    listed = {name: about.get(name, "Cannot be used; --help says why") for name in KINDS.names()}
    listed |= {"drives": "Emulated motor controllers on a CAN bus"}
    listed |= {"strategy": "What `vrg play --lockstep` starts on another machine by ssh"}
    listed |= {"host": "What `vrg play` starts on another machine by ssh"}
    return {"Run a single process of a match": {name: (partial(_node, name), about) for name, about in listed.items()}}


def _node(name: str) -> Callable[..., None]:
    function: Callable[..., None] = load_object("vrg.commands.node:command_of")(name)
    return function


def _views() -> Table:
    """The commands that show a running match: the kinds of processes that do, and those that need none of the match."""
    from vrg.kinds import every_kind  # noqa: PLC0415 - as above

    kinds = {
        kind.shown: (kind.command or partial(_node, kind.name), _sentence(kind.about))
        for kind in every_kind() if kind.shown
    }  # fmt: skip
    return {
        "Show a running match": kinds
        | {
            "camera": ("vrg.commands.sensors:camera", "Save a picture of what a robot sees"),
            "sensors": ("vrg.commands.sensors:sensors", "Show what a robot's sensors measure"),
            "processes": ("vrg.commands.show:processes", "Show the processes of a match on all its machines"),
            "diagram": ("vrg.commands.show:diagram", "Print the statechart of a player, as Mermaid"),
        }
    }


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}"


RUN: Table = {
    "Look at a recorded run (RUN; by default the newest in the folder runs)": {
        "list": ("vrg.commands.runs.run:list_runs", "List the runs in a folder, newest first, and how they ended"),
        "result": ("vrg.commands.runs.run:result", "Write result.json, and print how the match ended"),
        "plot": ("vrg.commands.runs.run:plot", "Draw the trajectories"),
        "replay": ("vrg.commands.runs.replay:replay", "Watch the match, or play on with another strategy"),
        "share": ("vrg.commands.runs.share:share", "Write the match as one HTML file for any browser"),
        "why": ("vrg.commands.runs.why:why", "Show why the referee made a call"),
        "judge": ("vrg.commands.runs.run:judge", "Judge the match again by the rule book"),
        "diff": (
            "vrg.commands.runs.differing:diff",
            "Find where two runs of a match diverge: the first step, node and field",
        ),
        "repeat": ("vrg.commands.runs.differing:repeat", "Play the match again, and check that it is the same"),
        "stops": ("vrg.commands.runs.stops:stops", "Show how the robots stopped when they had to"),
    }
}
COMMANDS: Table = {
    "Play": {
        "play": ("vrg.commands.play:play", "Play a match, show it, and print who won"),
        "practice": ("vrg.commands.practice:practice", "Try a player on a map, without rules"),
        "new": ("vrg.commands.new:app", "Write a starter player, match, map or driver"),
        "check": ("vrg.commands.play:check", "Check whether a match file can be played"),
    },
    "Watch and decide": {
        "show": (_views, "Watch a running match: window, web, sensors ..."),
        "official": ("vrg.commands.official:app", "Act as the official: halt, resume, end, overrule, substitute"),
        "estop": ("vrg.commands.estop:estop", "Stop every robot at once"),
        "run": (RUN, "Look at a recorded run: list, replay, why, result, plot ..."),
    },
    "Lab": {
        "doctor": ("vrg.commands.doctor:doctor", "Check whether this machine has what VRG needs"),
        "topic": ("vrg.commands.topic:app", "Look at the messages on the bus of a running match"),
        "keys": ("vrg.commands.keys:app", "Make and show the keys of a match's seats"),
        "node": (_nodes, "Run a single process: router, world, player ..."),
    },
}


class Commands(TyperGroup):
    """A group of commands that are imported when they are asked for. Its help page needs none of them."""

    table: ClassVar[Table]
    path: ClassVar[tuple[str, ...]] = ()
    """The words that are typed for this group, without `vrg` itself."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of the commands, those that other packages add among them."""
        return [name for listed in self._whole().values() for name in listed]

    def _whole(self) -> Table:
        """The table with the commands that other packages add."""
        from vrg.plugins import commands_below  # noqa: PLC0415 - to look them up takes time

        whole = {heading: dict(listed) for heading, listed in self.table.items()}
        own = {name for listed in self.table.values() for name in listed}
        for added in commands_below(self.path):
            if added.path[-1] not in own:
                whole.setdefault(added.heading, {})[added.path[-1]] = (added.target, added.about)
        return whole

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of this name, imported now; None if there is none."""
        if cmd_name not in self.commands:
            entry = next((listed[cmd_name] for listed in self.table.values() if cmd_name in listed), None)
            if entry is None:
                from vrg.plugins import command_at  # noqa: PLC0415 - VRG's own commands do not wait for it

                added = command_at((*self.path, cmd_name))
                if added is None:
                    return None
                load = partial(load_object, added.target)
                entry = partial(imported, load, f"cannot import {added.target}"), added.about
            self.commands[cmd_name] = _command((*self.path, cmd_name), *entry)
        return self.commands[cmd_name]

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that is asked for. If there is none, the message tells which may be meant, also in a group."""
        if self.get_command(ctx, args[0]) is None and args[0][:1] != "-":
            from vrg.plugins import where_from  # noqa: PLC0415 - most commands are there

            if wanted := where_from((*self.path, args[0])):
                ctx.fail(f"'{ctx.command_path} {args[0]}' is a command that {wanted}")
            known = {name: name for name in self.list_commands(ctx)}
            for group, (entry, _) in (pair for listed in self.table.values() for pair in listed.items()):
                what = entry() if callable(entry) else entry
                if isinstance(what, Mapping):
                    for name in (name for listed in what.values() for name in listed):
                        known.setdefault(name, f"{group} {name}")  # `vrg show web` rather than `vrg node web`
            meant = close_to(args[0], known)
            hint = f" Did you mean '{ctx.command_path} {known[meant]}'?" if meant else ""
            ctx.fail(f"No such command '{args[0]}'.{hint}")
        return super().resolve_command(ctx, args)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the command line. Without a command, the help page is printed."""
        if not args and not ctx.resilient_parsing:
            typer.echo(ctx.get_help())
            raise typer.Exit(2)
        return super().parse_args(ctx, args)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page: the commands below their headings, a line for each."""
        formatter.write(f"Usage: {ctx.command_path} COMMAND ...   (each has --help)\n")
        whole = self._whole()
        width = max(len(name) for listed in whole.values() for name in listed)
        for heading, listed in whole.items():
            formatter.write(f"\n{typer.style(heading, bold=True)}\n")
            for name, (_, about) in listed.items():
                formatter.write(f"  {typer.style(name.ljust(width), fg='cyan')}  {about}\n")
        if ctx.parent is None:
            there = any(WITHOUT_COMMAND in listed for listed in whole.values())
            alone = f"Without a command, vrg runs vrg {WITHOUT_COMMAND}. " if there else ""
            formatter.write(f"{alone}Also: --version, --install-completion.\n")


def _command(path: tuple[str, ...], what: Any, about: str) -> Any:
    """Make a command, or a group, of the table."""
    name = path[-1]
    found = load_object(what) if isinstance(what, str) else what() if callable(what) else what
    if isinstance(found, Mapping):
        app = _group(found, path)
    elif isinstance(found, typer.Typer):
        app = found
    else:
        from vrg.commands.groups import CommandGroup  # noqa: PLC0415 - as above

        app = CommandGroup()
        app.command(name)(found)
    app.info.help, app.info.name = about, name
    app._add_completion = False
    return typer.main.get_command(app)


def _group(table: Table, path: tuple[str, ...] = ()) -> typer.Typer:
    app = typer.Typer(cls=type("Group", (Commands,), {"table": table, "path": path}), pretty_exceptions_enable=False)
    app.callback()(lambda: None)
    return app


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


def _options(
    _version_wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def make_app() -> typer.Typer:
    """Make the command line."""
    app = _group(COMMANDS)
    app.callback()(_options)
    return app


def _in_place_of_nothing() -> list[str] | None:
    """The arguments where nothing was typed at a terminal, if a package adds that command; None for what was typed."""
    if sys.argv[1:] or not (sys.stdin.isatty() and sys.stdout.isatty()):
        return None
    from vrg.plugins import COMMANDS as ADDED  # noqa: PLC0415 - as above

    return [WITHOUT_COMMAND] if WITHOUT_COMMAND in ADDED else None


def main() -> None:
    """Run the command line. An expected error becomes a message and status 1, never a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal may lack the letters of a name
    try:
        make_app()(_in_place_of_nothing())
    except VrgError as error:
        text = str(error) if isinstance(error, ConfigError) else f"vrg: {error}"
        print(printable(text, lines=True), file=sys.stderr)
        sys.exit(1)
    except ModuleNotFoundError as error:
        from vrg.packages import PACKAGES, lacking  # noqa: PLC0415 - only a mistake needs it

        if error.name is None or error.name not in PACKAGES:
            raise
        print(f"vrg: {lacking(error.name) or error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
