"""The command `vrg hud`, which opens the head-up display of a player of a running match."""

from typing import Annotated

import typer

from vrg.commands.attaching import SetupArgument, attached
from vrg.commands.options import EndpointOption, KeysOption, NameOption, keys_of, need_display
from vrg.errors import DuplicateNodeError, LaunchError


def hud(
    player: Annotated[str, typer.Argument(metavar="PLAYER", help="Name of a player of the match.")],
    match: SetupArgument = None,
    name: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
) -> None:
    """Open the head-up display of a player: what it knows, and Goto, Manual and Reset by button, key and gamepad."""
    from vrg.launch.serving import serve

    found = attached(match, name, router)
    setup, endpoint = found.known_setup("vrg hud NAME match.toml"), found.endpoint
    setup.player(player)
    need_display()
    try:
        stop = serve("hud", setup, router=endpoint, name=player, keys=keys_of(endpoint, seats))
    except DuplicateNodeError:
        raise LaunchError(f"{player} has a head-up display already, and a player has only one") from None
    if stop.interrupted:
        raise typer.Exit(130)
