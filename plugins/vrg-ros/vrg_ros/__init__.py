"""Matches in ROS 2 without ROS: what it sees of them, the players that its nodes drive, and robots that run it."""

from typing import Final

from vrg.kinds import Kind
from vrg.packages import Package
from vrg.plugins import Option
from vrg.seats.seat import SeatKind

DRIVEN: Final = "ros"
"""The name of the strategy of players that ROS nodes drive."""

KIND: Final = Kind(
    name="ros",
    about="the match in ROS 2, with no ROS needed here",
    seats=(SeatKind.OFFICIAL, SeatKind.WINDOW),
    process="ros",
    pulse="spectator",
    node="vrg_ros.node:ros",
    command="vrg_ros.command:ros",
    shown="ros",
    opens="vrg_ros.command:open_ros",
    option=Option("--ros", "Let ROS 2 see the match, and drive players with the strategy ros."),
    needs={"xxhash": Package("virtual-robotic-games-ros", ("xxhash",))},
    drives=DRIVEN,
    views=True,
)
"""The process that shows a match to ROS 2."""
