"""The head-up display of one player (thesis 4.1): what the player knows, and a person who sends or drives its robot."""

from typing import Final

from vrg.kinds import Kind
from vrg.seats.seat import SeatKind

KIND: Final = Kind(
    name="hud",
    about="the head-up display of a player, with Goto, Manual and Reset",
    seats=(SeatKind.HUD,),
    node="vrg_views.hud.node:hud",
    runner="vrg.launch.process_main:run_window",
    named="player",
    command="vrg_views.hud.command:hud",
    shown="hud",
)
"""The window of one player."""
