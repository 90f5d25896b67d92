"""Where Foxglove sees a running match."""

from typing import TYPE_CHECKING

from vrg.commands.options import listening_address
from vrg.kinds import Opening
from vrg_views.foxglove.live import PORT

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup


def open_foxglove(_setup: "MatchSetup", typed: str | None, *, secured: bool) -> Opening:
    """The address and a free port for Foxglove's server; see `vrg.kinds.Kind` and `listening_address`.

    Raises:
        LaunchError: no port is free there.
    """
    address = listening_address(typed, PORT, "Foxglove's server")
    return Opening(address, lambda _: f"in Foxglove: Open connection, Foxglove WebSocket, ws://{address}")
