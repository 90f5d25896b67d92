"""Matches in Foxglove while they are played. Only `live` knows its SDK."""

from typing import Final

from vrg.kinds import Kind
from vrg.packages import Package
from vrg.plugins import Option
from vrg.seats.seat import SeatKind

KIND: Final = Kind(
    name="foxglove",
    about="all that a recording holds, in Foxglove",
    seats=(SeatKind.OFFICIAL, SeatKind.WINDOW),
    process="foxglove",
    pulse="spectator",
    node="vrg_views.foxglove.node:foxglove",
    shown="foxglove",
    views=True,
    opens="vrg_views.foxglove.command:open_foxglove",
    option=Option("--foxglove", "Let Foxglove on this machine connect, and show all that is recorded."),
    needs={"foxglove": Package("virtual-robotic-games-views[foxglove]", ("foxglove-sdk",))},
)
"""The process to which Foxglove connects."""
