"""Where a match is served in three dimensions, and a recorded one on the command line."""

from typing import TYPE_CHECKING, Final

import typer

from vrg.commands.options import listening_address, stoppable
from vrg.kinds import Opening

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.ui.timeline import Timeline

PORT: Final = 8090
"""The port of the page, if it is free."""


def open_three(_setup: "MatchSetup", typed: str | None, *, secured: bool) -> Opening:
    """The address and a free port for the view; see `vrg.kinds.Kind` and `vrg.commands.options.listening_address`.

    Raises:
        LaunchError: no port is free there.
    """
    address = listening_address(typed, PORT, "the view in three dimensions")
    return Opening(address, lambda _: _link(address))


def show_replay(timeline: "Timeline", setup: "MatchSetup", since: float | None, listen: str | None) -> None:
    """Serve a recorded match in three dimensions until Ctrl-C is pressed.

    Args:
        since: the match time at which it begins, s; None for the first instant.
        listen: the address that was typed, or None.

    Raises:
        LaunchError: no port is free there.
    """
    from vrg_views.three.replay import ThreeReplay
    from vrg_views.three.theatre import theatre

    address = open_three(setup, listen, secured=False).name
    replay = ThreeReplay(theatre(setup, address), timeline)
    if since is not None:
        replay.playback = replay.playback.to(since)
    typer.echo(f"{_link(address)}   (Ctrl-C ends it)")
    with stoppable() as stop:
        replay.run(stop.wait)


def _link(address: str) -> str:
    return f"in three dimensions: http://{address}"
