"""The `vrg` command. Exit status: 0 good, 1 failed, 2 wrong usage, 130 interrupted."""

import os
import sys
from typing import Annotated

import typer

from vrg import __version__
from vrg.commands import can, diagram, doctor, official, play, processes, topic
from vrg.errors import ConfigError, VrgError

# What pygame prints on import would be the first line of every command.
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Virtual Robotic Games: games that robots play, refereed.",
)
app.command()(play.play)
app.command()(play.check)
app.command()(official.estop)
app.add_typer(official.app, name="official")
app.add_typer(topic.app, name="topic")
app.add_typer(can.app, name="can")
app.command()(diagram.diagram)
app.command()(doctor.doctor)
for node in (
    processes.router,
    processes.world,
    processes.coordinator,
    processes.player,
    processes.recorder,
    processes.spectator,
):
    app.command(rich_help_panel="Single processes")(node)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def _options(
    _version_wanted: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line; expected errors are a message and status 1, never a traceback."""
    try:
        app()
    except VrgError as error:
        print(error if isinstance(error, ConfigError) else f"vrg: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
