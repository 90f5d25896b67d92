"""The command `vrg foxglove`, which shows a running match in Foxglove."""

from typing import Annotated

import typer

from vrg.commands.attaching import SetupArgument, attached
from vrg.commands.options import EndpointOption, KeysOption, NameOption, keys_of
from vrg.errors import LaunchError

AtOption = Annotated[
    str | None,
    typer.Option("--at", metavar="HOST[:PORT]", help="Where; this machine only if missing; 0.0.0.0 is for all."),
]


def foxglove(
    match: SetupArgument = None,
    name: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    at: AtOption = None,
) -> None:
    """Show a running match in Foxglove: all that a recording holds, as it happens. Nobody can change anything there."""
    from vrg.launch.serving import serve

    address = live_address(at)
    found = attached(match, name, router)
    setup, endpoint = found.known_setup("vrg foxglove match.toml"), found.endpoint
    typer.echo(told(address))
    stop = serve("foxglove", setup, router=endpoint, name=address, keys=keys_of(endpoint, seats))
    if stop.interrupted:
        raise typer.Exit(130)


def live_address(typed: str | None) -> str:
    """The address and a free port for Foxglove's server, as `HOST:PORT`.

    Args:
        typed: such as `0.0.0.0:8765`; None for this machine only.

    Raises:
        typer.BadParameter: it is no address. LaunchError: no port is free there, or the SDK is not installed.
    """
    from vrg.commands.options import web_address
    from vrg.launch.endpoints import free_port
    from vrg.recording.live import PORT

    host, port = web_address(typed)
    try:
        found = free_port(host, PORT) if port is None else free_port(host, port, tries=1)
    except OSError as error:
        raise LaunchError(f"no server for Foxglove can be opened: {error}") from error
    return f"[{host}]:{found}" if ":" in host else f"{host}:{found}"


def told(address: str) -> str:
    """What a person does to see the match."""
    return f"in Foxglove: Open connection, Foxglove WebSocket, ws://{address}"
