"""Options that several subcommands share."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.bus.stopping import Stop, stop_on_signals
from vrg.errors import ConfigError

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


def own_match(match: str | None, router: str | None, what: str) -> tuple[str, str]:
    """The (match, endpoint) that a command means which changes a running match.

    If it is not named, and was started in another folder, the person is asked: it may be somebody else's.

    Args:
        what: is to be done, in words.

    Raises:
        ConfigError: it is not clear which match is meant, or nobody can be asked.
        typer.Exit: the person does not want it.
    """
    from vrg.launch import running  # only commands on a running match need platformdirs

    name, endpoint = which_match(match, router)
    found = next((m for m in running.running() if (m.match, m.router) == (name, endpoint)), None)
    if match is None and router is None and found is not None and not found.is_own:
        told = f"the only match that runs here is {name}, started in {found.folder}"
        if not sys.stdin.isatty():
            raise ConfigError([f"{told}: if you mean it, add --match {name}"])
        if not typer.confirm(f"{told}: {what}?"):
            raise typer.Exit(1)
    return name, endpoint


def whole_target(strategy: str) -> str:
    """A strategy as it was typed; that of a file, or of a module in the working folder, with the whole path."""
    path, colon, name = strategy.rpartition(":")
    file = path if path.endswith(".py") else f"{path}.py"
    return f"{Path(file).resolve()}{colon}{name}" if colon and Path(file).is_file() else strategy
