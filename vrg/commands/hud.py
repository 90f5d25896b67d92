"""The command `vrg hud`, which opens the head-up display of a player of a running match."""

from pathlib import Path
from typing import Annotated

import typer

from vrg.commands.options import EndpointOption, KeysOption, NameOption, keys_of, need_display, which_match
from vrg.config.setup import MatchSetup, read_setup
from vrg.errors import ConfigError, DuplicateNodeError, LaunchError


def hud(
    player: Annotated[str, typer.Argument(metavar="PLAYER", help="Name of a player of the match.")],
    match: Annotated[
        str | None,
        typer.Argument(metavar="[GAME|match.toml]", help="The match file; needed if the match runs elsewhere."),
    ] = None,
    name: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
) -> None:
    """Open the head-up display of a player: what it knows, and Goto, Manual and Reset by button, key and gamepad."""
    from vrg.launch.serving import serve

    setup, endpoint = _setup(match, name, router)
    setup.player(player)
    need_display()
    try:
        stop = serve("hud", setup, router=endpoint, name=player, keys=keys_of(endpoint, seats))
    except DuplicateNodeError:
        raise LaunchError(f"{player} has a head-up display already, and a player has only one") from None
    if stop.interrupted:
        raise typer.Exit(130)


def _setup(match: str | None, name: str | None, router: str | None) -> tuple[MatchSetup, str]:
    """The set-up of the match that is meant, and the endpoint of its router.

    A match that runs on this machine has left its set-up in its run folder.

    Raises:
        ConfigError: it is not clear which match is meant, or nobody here knows its set-up.
    """
    from vrg.launch import running

    if match is not None:
        from vrg.config.loading import load_match, match_path

        setup = load_match(match_path(match))
        if name not in (None, setup.name):
            raise ConfigError([f"{match}: expected the match file of {name!r}, got that of {setup.name!r}"])
        return setup, router or which_match(setup.name, router)[1]
    found, endpoint = which_match(name, router)
    here = next((m for m in running.running() if (m.match, m.router) == (found, endpoint)), None)
    if here is None:
        raise ConfigError(
            [f"{found} runs on another machine: name its match file too, as in `vrg hud NAME match.toml`"]
        )
    from vrg.launch.run_folder import RunFolder

    return read_setup(RunFolder(Path(here.run)).setup), endpoint
