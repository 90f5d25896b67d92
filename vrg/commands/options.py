"""Options that several subcommands share."""

import logging
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.bus.stopping import Stop, stop_on_signals
from vrg.launch import registry

log = logging.getLogger(__name__)

MatchArgument = Annotated[
    str, typer.Argument(metavar="GAME|match.toml", help="A match file, or a game's name for its default match.")
]
RouterOption = Annotated[str, typer.Option("--router", help="Endpoint of the router, such as tcp/192.168.1.5:7447.")]
RunOption = Annotated[Path | None, typer.Option("--run", help="Run folder to write to.")]
BaseOption = Annotated[Path | None, typer.Option("--base", hidden=True)]
LeashOption = Annotated[bool, typer.Option("--leash", hidden=True)]
NameOption = Annotated[str | None, typer.Option("--match", help="Name of the match, if several run.")]
EndpointOption = Annotated[str | None, typer.Option("--router", help="Endpoint of its router, if several run.")]


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Until SIGINT or SIGTERM.

    Raises:
        typer.Exit: at the end, with status 130, after Ctrl-C.
    """
    with stop_on_signals() as stop:
        yield stop
    if stop.interrupted:
        raise typer.Exit(130)


def which_match(match: str | None, router: str | None) -> tuple[str, str]:
    """The (match, endpoint) that a command on a running match means.

    Raises:
        ConfigError: it is not clear which.
    """
    return registry.find(match, router, DEFAULT_ENDPOINT)


@contextmanager
def child_process(leash: bool) -> Iterator[Stop]:
    """Logging, signals, and the leash of the supervisor: standard input ends when it dies."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    # zenoh's threads wait for the interpreter's lock: let it go sooner than the default 5 ms.
    sys.setswitchinterval(1e-3)
    with stoppable() as stop:
        if leash:
            threading.Thread(target=_hold_leash, args=(stop,), daemon=True).start()
        yield stop


def _hold_leash(stop: Stop) -> None:
    # The bare descriptor: a thread inside sys.stdin's lock would keep the interpreter from ending.
    while os.read(0, 64):
        pass
    log.info("stopping: the supervisor is gone")
    stop.set()
