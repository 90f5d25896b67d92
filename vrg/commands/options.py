"""Options that several subcommands share."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from vrg.bus.credentials import Credentials, find_credentials
from vrg.bus.seats import Seat
from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.bus.stopping import Stop, stop_on_signals
from vrg.errors import ConfigError, LaunchError

MatchArgument = Annotated[
    str, typer.Argument(metavar="GAME|match.toml", help="A match file, or a game's name for its default match.")
]
RouterOption = Annotated[str, typer.Option("--router", help="Endpoint of the router, such as tcp/192.168.1.5:7447.")]
RunOption = Annotated[Path | None, typer.Option("--run", help="Run folder to write to.")]
RunsOption = Annotated[Path, typer.Option(help="Folder in which the run folder is made.")]
LeashOption = Annotated[bool, typer.Option("--leash", hidden=True)]
NameOption = Annotated[str | None, typer.Option("--match", help="Name of the match; needed if several run.")]
EndpointOption = Annotated[str | None, typer.Option("--router", help="Endpoint of its router; needed if several run.")]
ThreeOption = Annotated[bool, typer.Option("--3d", help="Show it in three dimensions in browsers on this machine.")]

KEYS_VARIABLE = "VRG_KEYS"
"""The variable that may name the folder of the keys in place of --keys."""
KeysOption = Annotated[
    Path | None,
    typer.Option("--keys", envvar=KEYS_VARIABLE, help="Folder of the keys of the match's seats; see `vrg keys`."),
]


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


def keys_of(endpoint: str, typed: Path | None) -> Path | None:
    """The folder of the keys of a running match; None where its router wants none, or nobody knows the folder.

    Args:
        typed: what was typed with --keys, or is in VRG_KEYS. If a match that runs on this machine has told where its
            keys are, only what was typed stands above that: the variable may be meant for another match.
    """
    if typed is not None and str(typed) != os.environ.get(KEYS_VARIABLE):
        # An endpoint that has no use for them is told.
        return typed
    if not endpoint.startswith("tls/"):
        return None
    from vrg.launch import running  # only commands on a running match need platformdirs

    return next((Path(m.keys) for m in running.running() if m.router == endpoint and m.keys), typed)


def credentials_for(endpoint: str, typed: Path | None, *seats: Seat) -> Credentials | None:
    """The keys with which a command on a running match opens a session; None where the router wants none.

    Args:
        typed: as for `keys_of`. seats: the seats that will do, the preferred one first.

    Raises:
        CredentialsError: there are no keys of such a seat.
    """
    keys = keys_of(endpoint, typed)
    return None if keys is None else find_credentials(keys, seats)


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


def table_console() -> Console:
    """A console for a table: where the output is no terminal, whose width is known, there is room for all columns."""
    return Console(highlight=False, width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 160)


def has_display() -> bool:
    """Whether a window can be opened."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    from vrg.ui.spectator import display_available  # without a display the window library is not loaded

    return display_available()


def need_display() -> None:
    """Make sure that a window can be opened.

    Raises:
        LaunchError: no screen answers.
    """
    from vrg.ui.spectator import display_available  # pygame takes half a second to load

    if not display_available():
        raise LaunchError("expected a display to open a window on, found none: set DISPLAY or WAYLAND_DISPLAY")


def whole_target(strategy: str) -> str:
    """A strategy as it was typed; that of a file, or of a module in the working folder, with the whole path."""
    path, colon, name = strategy.rpartition(":")
    file = path if path.endswith(".py") else f"{path}.py"
    return f"{Path(file).resolve()}{colon}{name}" if colon and Path(file).is_file() else strategy


def web_address(typed: str | None, option: str = "--at") -> tuple[str, int | None]:
    """The address and the port at which something is served; None for a port that was not typed.

    Args:
        typed: such as `0.0.0.0:8080`, `192.168.1.5` or `[::1]:8080`; None for this machine only.
        option: the option with which it was typed.

    Raises:
        typer.BadParameter: it is none of these.
    """
    from vrg.ui.web.admission import DEFAULT_HOST

    if typed is None:
        return DEFAULT_HOST, None
    host, colon, port = typed.rpartition(":") if typed.count(":") == 1 or "]:" in typed else (typed, "", "")
    if not host.strip("[]") or (colon and not (port.isdecimal() and 0 < int(port) < 65536)):
        raise typer.BadParameter(f"expected an address such as 0.0.0.0:8080, got {typed!r}", param_hint=option)
    return host.strip("[]"), int(port) if colon else None
