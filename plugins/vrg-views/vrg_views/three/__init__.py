"""Matches in three dimensions, in browsers, running and recorded. Only `theatre` knows viser, which draws them."""

from typing import Final

from vrg.kinds import Kind
from vrg.packages import Package
from vrg.plugins import Option
from vrg.seats.seat import SeatKind

KIND: Final = Kind(
    name="three",
    about="the match in three dimensions, in browsers",
    # Nobody decides anything there, so it prefers the seat that may not.
    seats=(SeatKind.WINDOW, SeatKind.OFFICIAL),
    process="3d",
    pulse="spectator",
    node="vrg_views.three.node:three",
    shown="3d",
    opens="vrg_views.three.command:open_three",
    needs={"viser": Package("virtual-robotic-games-views[three]", ("viser",))},
    replays="vrg_views.three.command:show_replay",
    option=Option("--3d", "Show the match in three dimensions in browsers on this machine."),
    views=True,
)
"""The process that serves a match in three dimensions."""
