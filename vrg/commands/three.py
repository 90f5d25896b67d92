"""The command `vrg show 3d`, a running match in three dimensions; `vrg play` and `vrg run replay` share its parts."""

from typing import TYPE_CHECKING

import typer

from vrg.commands.matches import attached, keys_of
from vrg.commands.options import (
    KeysOption,
    ListenOption,
    MatchArgument,
    RouterOption,
    exit_if_interrupted,
    stoppable,
    web_address,
)
from vrg.errors import LaunchError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.ui.timeline import Timeline


def three(
    match: MatchArgument = None, router: RouterOption = None, keys: KeysOption = None, listen: ListenOption = None
) -> None:
    """Show a running match in three dimensions in browsers. It changes nothing."""
    from vrg.launch.serving import serve

    address = three_address(listen)
    found = attached(match, router)
    setup = found.known_setup()
    typer.echo(three_link(address))
    exit_if_interrupted(serve("three", setup, router=found.endpoint, name=address, keys=keys_of(found.endpoint, keys)))


def show_replay(timeline: "Timeline", setup: "MatchSetup", since: float | None) -> None:
    """Serve a recorded match in three dimensions until Ctrl-C is pressed.

    Args:
        since: the match time at which it begins, s; None for the first instant.
    """
    from vrg.launch.nodes import theatre
    from vrg.ui.three.replay import ThreeReplay

    address = three_address(None)
    replay = ThreeReplay(theatre(setup, address), timeline)
    if since is not None:
        replay.playback = replay.playback.to(since)
    typer.echo(f"{three_link(address)}   (Ctrl-C ends it)")
    with stoppable() as stop:
        replay.run(stop.wait)


def three_address(typed: str | None) -> str:
    """The address and a free port for the view in three dimensions, as `HOST:PORT`.

    Args:
        typed: such as `0.0.0.0:8090`; None for this machine only.

    Raises:
        typer.BadParameter: it is no address. LaunchError: no port is free there, or viser is not installed.
    """
    from vrg.launch.endpoints import free_port
    from vrg.ui.three.theatre import PORT

    host, port = web_address(typed)
    try:
        found = free_port(host, PORT) if port is None else free_port(host, port, tries=1)
    except OSError as error:
        raise LaunchError(f"the view in three dimensions cannot be served: {error}") from error
    return f"[{host}]:{found}" if ":" in host else f"{host}:{found}"


def three_link(address: str) -> str:
    """The link of the view."""
    return f"in three dimensions: http://{address}"
