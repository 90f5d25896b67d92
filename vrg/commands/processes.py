"""The commands `vrg router`, `world`, `coordinator`, `player`, `recorder` and `spectator`: each runs one process."""

import os
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.process import run_node
from vrg.bus.seats import SeatKind, seats_of_node
from vrg.bus.session import DEFAULT_ENDPOINT, open_session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.commands.attaching import SetupArgument, attached
from vrg.commands.options import (
    EndpointOption,
    KeysOption,
    LeashOption,
    MatchArgument,
    NameOption,
    RouterOption,
    RunOption,
    credentials_for,
    need_display,
    whole_target,
)
from vrg.errors import ConfigError
from vrg.launch.serving import WINDOW_PERIOD, child_process, serve, serve_router


def _ended(stop: Stop) -> None:
    if stop.interrupted:
        raise typer.Exit(130)


def router(
    match: Annotated[
        str | None, typer.Argument(metavar="[GAME|match.toml]", help="The match whose seats may connect; needs --keys.")
    ] = None,
    endpoint: RouterOption = DEFAULT_ENDPOINT,
    upstream: Annotated[str | None, typer.Option(help="Endpoint of another router to be linked with.")] = None,
    keys: KeysOption = None,
    leash: LeashOption = False,
) -> None:
    """Serve as the router that all processes of a match connect to. With keys, it lets only seats in."""
    if match is None:
        if keys is not None:
            raise ConfigError(
                [
                    f"expected the match file whose seats have the keys in {keys}, got none: `vrg router match.toml "
                    f"--keys {keys}`; a router that lets everybody in needs neither --keys nor VRG_KEYS"
                ]
            )
        _ended(serve_router(endpoint, upstream=upstream, leash=leash))
        return
    from vrg.config.loading import load_match, match_path  # a router without seats needs no match file

    if keys is None:
        raise ConfigError(["expected the folder of the match's keys, with --keys or in VRG_KEYS: see `vrg keys init`"])
    setup = load_match(match_path(match))
    _ended(serve_router(endpoint, upstream=upstream, setup=setup, keys=keys, leash=leash))


def _serve(
    kind: str,
    match: str,
    router: str,
    run: Path | None,
    name: str = "",
    strategy: str | None = None,
    keys: Path | None = None,
) -> None:
    """Read the match file and run the node until it is stopped."""
    from vrg.config.loading import load_match, match_path  # the router needs no match file

    setup = load_match(match_path(match))
    if kind == "player":
        setup.player(name)
    if strategy is not None:
        setup = setup.substituted(name, whole_target(strategy))
    _ended(serve(kind, setup, router=router, run=run, name=name, keys=keys if router.startswith("tls/") else None))


def world(
    match: MatchArgument, router: RouterOption = DEFAULT_ENDPOINT, run: RunOption = None, keys: KeysOption = None
) -> None:
    """Run the world: physics, sensors and the match clock. Goes on from the run folder's snapshot, if there is one."""
    _serve("world", match, router, run, keys=keys)


def coordinator(
    match: MatchArgument, router: RouterOption = DEFAULT_ENDPOINT, run: RunOption = None, keys: KeysOption = None
) -> None:
    """Run the referee. Goes on from the run folder's journal, in HALT, if there is one."""
    _serve("coordinator", match, router, run, keys=keys)


def recorder(
    match: MatchArgument, router: RouterOption = DEFAULT_ENDPOINT, run: RunOption = None, keys: KeysOption = None
) -> None:
    """Record a match to the run folder, for Foxglove."""
    _serve("recorder", match, router, run, keys=keys)


def player(
    match: MatchArgument,
    name: Annotated[str, typer.Argument(help="Name of the player in the match file.")],
    router: RouterOption = DEFAULT_ENDPOINT,
    run: RunOption = None,
    keys: KeysOption = None,
    strategy: Annotated[
        str | None, typer.Option(help="Strategy in place of the match file's, such as mine.py:Mine.")
    ] = None,
) -> None:
    """Run one player with its robot. A match that runs takes it in, if nobody else plays for it."""
    # A process with threads cannot be sealed, and the library of numpy, which reads match files, starts some.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _serve("player", match, router, run, name, strategy, keys)


def spectator(
    match: SetupArgument = None,
    name: NameOption = None,
    router: EndpointOption = None,
    run: RunOption = None,
    seats: KeysOption = None,
) -> None:
    """Watch a match in a window; several may. Closing the window does not end the match."""
    from vrg.ui.spectator import Spectator  # pygame takes half a second to load

    need_display()
    found = attached(match, name, router)
    credentials = credentials_for(found.endpoint, seats, *seats_of_node("spectator", ""))
    official = credentials is None or credentials.common_name == SeatKind.OFFICIAL
    with (
        child_process(leash=False) as stop,
        open_session(found.endpoint, stop=stop, credentials=credentials) as session,
    ):
        node = Spectator(
            f"window-{os.getpid()}",
            Mailbox(),
            Keys(found.name),
            sizes=found.sizes,
            obstacles=found.obstacles,
            run=run or found.run,
            official=official,
        )
        run_node(node, session, Keys(found.name), stop, finished=lambda: node.closed, idle=WINDOW_PERIOD)
    _ended(stop)
