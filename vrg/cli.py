"""The `vrg` command. Its exit status is 0 for success, 1 for failure, 2 for wrong usage, and 130 if interrupted.

The module of a subcommand is imported only if that subcommand is asked for, so that a command such as
`vrg official halt` does not wait for physics to load.
"""

import os
import sys
from typing import Annotated, Any

import typer

from vrg import __version__
from vrg.errors import ConfigError, VrgError
from vrg.registry import load_object
from vrg.types import printable

# Without this, a line that pygame prints on import would be the first line of every command.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

_PROCESSES = "Single processes"
COMMANDS: dict[str, tuple[str, str | None]] = {
    "play": ("vrg.commands.play:play", None),
    "practice": ("vrg.commands.practice:practice", None),
    "check": ("vrg.commands.play:check", None),
    "compare": ("vrg.commands.compare:compare", None),
    "tournament": ("vrg.commands.tournament:tournament", None),
    "new": ("vrg.commands.new:app", None),
    "edit": ("vrg.commands.welcome:edit", None),
    "estop": ("vrg.commands.estop:estop", None),
    "official": ("vrg.commands.official:app", None),
    "result": ("vrg.commands.after:result", None),
    "plot": ("vrg.commands.after:plot", None),
    "replay": ("vrg.commands.replay:replay", None),
    "why": ("vrg.commands.why:why", None),
    "judge": ("vrg.commands.judge:judge", None),
    "stops": ("vrg.commands.stops:stops", None),
    "substitute": ("vrg.commands.substitute:substitute", None),
    "sensors": ("vrg.commands.sensors:sensors", None),
    "hud": ("vrg.commands.hud:hud", None),
    "developer": ("vrg.commands.developer:developer", None),
    "commander": ("vrg.commands.commander:commander", None),
    "web": ("vrg.commands.web:web", None),
    "foxglove": ("vrg.commands.foxglove:foxglove", None),
    "3d": ("vrg.commands.three:three", None),
    "camera": ("vrg.commands.camera:camera", None),
    "topic": ("vrg.commands.topic:app", None),
    "keys": ("vrg.commands.keys:app", None),
    "can": ("vrg.commands.can:app", None),
    "diagram": ("vrg.commands.diagram:diagram", None),
    "processes": ("vrg.commands.running:processes", None),
    "deploy": ("vrg.commands.deploy:app", None),
    "host": ("vrg.commands.host:host", "Single processes"),
    "doctor": ("vrg.commands.doctor:doctor", None),
    **{
        name: (f"vrg.commands.processes:{name}", _PROCESSES)
        for name in ("router", "world", "coordinator", "player", "recorder", "spectator")
    },
}
"""The `module:object` of each subcommand, and the panel of the help text in which it is listed."""


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


def make_app(asked: str | None = None) -> typer.Typer:
    """Make the command line with the one subcommand that is asked for, or with all if it is unknown or None."""
    app = typer.Typer(
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        help="Virtual Robotic Games: games that robots play, refereed.",
    )
    app.callback()(_options)
    for name in [asked] if asked in COMMANDS else COMMANDS:
        target, panel = COMMANDS[name]
        found: Any = load_object(target)
        if isinstance(found, typer.Typer):
            app.add_typer(found, name=name)
        else:
            app.command(name, rich_help_panel=panel)(found)
    return app


def welcome_app() -> typer.Typer:
    """Make the command line of plain `vrg` at a terminal, where a person chooses a match. Elsewhere it prints help."""
    app = typer.Typer(pretty_exceptions_enable=False, add_completion=False)
    app.command()(load_object("vrg.commands.welcome:welcome"))
    return app


def main() -> None:
    """Run the command line. An expected error becomes a message and status 1, never a traceback."""
    asked = next((word for word in sys.argv[1:] if not word.startswith("-")), None)
    try:
        if len(sys.argv) == 1 and sys.stdin.isatty() and sys.stdout.isatty():
            welcome_app()()
        make_app(asked)()
    except VrgError as error:
        said = str(error) if isinstance(error, ConfigError) else f"vrg: {error}"
        print(printable(said, lines=True), file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
