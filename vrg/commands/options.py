"""Options that several subcommands share."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.bus.stopping import Stop, stop_on_signals

MatchArgument = Annotated[
    str, typer.Argument(metavar="GAME|match.toml", help="A match file, or a game's name for its default match.")
]
RouterOption = Annotated[str, typer.Option("--router", help="Endpoint of the router, such as tcp/192.168.1.5:7447.")]
RunOption = Annotated[Path | None, typer.Option("--run", help="Run folder to write to.")]
LeashOption = Annotated[bool, typer.Option("--leash", hidden=True)]
NameOption = Annotated[str | None, typer.Option("--match", help="Name of the match; needed if several run.")]
EndpointOption = Annotated[str | None, typer.Option("--router", help="Endpoint of its router; needed if several run.")]


@contextmanager
def stoppable() -> Iterator[Stop]:
    """A Stop that SIGINT and SIGTERM set.

    Raises:
        typer.Exit: at the end of the context, with status 130, if Ctrl-C was pressed.
    """
    with stop_on_signals() as stop:
        yield stop
    if stop.interrupted:
        raise typer.Exit(130)


def which_match(match: str | None, router: str | None) -> tuple[str, str]:
    """The (match, endpoint) that a command on a running match means.

    Raises:
        ConfigError: it is not clear which match is meant.
    """
    from vrg.launch import running  # only commands on a running match need platformdirs

    return running.find(match, router, DEFAULT_ENDPOINT)
