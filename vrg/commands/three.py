"""The command `vrg 3d`, which shows a running match in three dimensions, and what `play` and `replay` do for --3d."""

from typing import TYPE_CHECKING, Annotated

import typer

from vrg.commands.attaching import SetupArgument, attached
from vrg.commands.options import EndpointOption, KeysOption, NameOption, keys_of, stoppable, web_address
from vrg.errors import LaunchError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.ui.timeline import Timeline


def three(
    match: SetupArgument = None,
    name: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    at: Annotated[
        str | None,
        typer.Option("--at", metavar="HOST[:PORT]", help="Where; this machine only if missing; 0.0.0.0 is for all."),
    ] = None,
) -> None:
    """Show a running match in three dimensions in browsers. Nobody can change anything there."""
    from vrg.launch.serving import serve

    address = three_address(at)
    found = attached(match, name, router)
    setup, endpoint = found.known_setup("vrg 3d match.toml"), found.endpoint
    typer.echo(told(address))
    stop = serve("three", setup, router=endpoint, name=address, keys=keys_of(endpoint, seats))
    if stop.interrupted:
        raise typer.Exit(130)


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
    typer.echo(f"{told(address)}   (Ctrl-C ends it)")
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


def told(address: str) -> str:
    """The link of the view."""
    return f"in three dimensions: http://{address}"
