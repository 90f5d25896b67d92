"""The command `vrg show 3d`, a running match in three dimensions; `vrg play` and `vrg run replay` share its parts."""

from typing import TYPE_CHECKING

import typer

from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached
from vrg.commands.options import ListenOption, listening_address, stoppable
from vrg.kinds import THREE

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.ui.timeline import Timeline


def three(on: MatchOptions, listen: ListenOption = None) -> None:
    """Show a running match in three dimensions in browsers. It changes nothing."""
    address, found = three_address(listen), attached(on)
    found.known_setup()
    typer.echo(three_link(address))
    found.serve(THREE, address)


def show_replay(timeline: "Timeline", setup: "MatchSetup", since: float | None, listen: str | None) -> None:
    """Serve a recorded match in three dimensions until Ctrl-C is pressed.

    Args:
        since: the match time at which it begins, s; None for the first instant.
        listen: the address that was typed, or None.
    """
    from vrg.launch.nodes.three import theatre
    from vrg.ui.three.replay import ThreeReplay

    address = three_address(listen)
    replay = ThreeReplay(theatre(setup, address), timeline)
    if since is not None:
        replay.playback = replay.playback.to(since)
    typer.echo(f"{three_link(address)}   (Ctrl-C ends it)")
    with stoppable() as stop:
        replay.run(stop.wait)


def three_address(typed: str | None) -> str:
    """The address and a free port for the view in three dimensions; see `listening_address`.

    Raises:
        LaunchError: no port is free there, or viser is not installed.
    """
    from vrg.ui.three.theatre import PORT

    return listening_address(typed, PORT, "the view in three dimensions")


def three_link(address: str) -> str:
    """The link of the view."""
    return f"in three dimensions: http://{address}"
