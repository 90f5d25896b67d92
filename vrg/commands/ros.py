"""The command `vrg ros`: a match appears in ROS 2."""

import os
from typing import Annotated

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.process import run_node
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.topics import Keys
from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached, connected
from vrg.commands.options import make_console


def ros(
    on: MatchOptions,
    domain: Annotated[int, typer.Option(min=0, max=232, help="ROS_DOMAIN_ID.", envvar="ROS_DOMAIN_ID")] = 0,
) -> None:
    """Let ROS 2 see a match: topics of each robot, tf, map, markers, referee and /clock, until Ctrl-C. It needs no ROS.

    ROS nodes use rmw_zenoh and the match's router; docs/ros.md has what they must set.
    """
    from vrg.ros.graph import RosNode
    from vrg.ros.publisher import RosPublisher, ros_name

    match = attached(on)
    namespace = f"/{ros_name(match.name)}"
    robots = {} if match.setup is None else {player.name: player.robot for player in match.setup.players}
    with connected(match.endpoint, on.keys, Seat(SeatKind.WINDOW), Seat(SeatKind.OFFICIAL)) as (stop, session):
        graph = RosNode(session, domain, "vrg", namespace)
        node = RosPublisher(
            f"ros-{os.getpid()}",
            Mailbox(),
            Keys(match.name),
            namespace,
            graph.publish,
            robots=robots,
            obstacles=match.obstacles,
        )
        console = make_console()
        console.print(f"{match.name} is in ROS 2 as {namespace}, in domain {domain}, by the router {match.endpoint}.")
        run_node(node, session, Keys(match.name), stop)
