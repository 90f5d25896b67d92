"""The command `vrg show ros`: a match appears in ROS 2."""

import os
from typing import Annotated

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.process import run_node
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached, connected
from vrg.commands.options import make_console
from vrg.errors import ConfigError


def ros(
    on: MatchOptions,
    to: Annotated[
        str | None,
        typer.Option(metavar="ENDPOINT", help="The router of ROS nodes, such as rmw_zenohd's; the match's if missing."),
    ] = None,
    domain: Annotated[int, typer.Option(min=0, max=232, help="ROS_DOMAIN_ID.", envvar="ROS_DOMAIN_ID")] = 0,
) -> None:
    """Let ROS 2 see a match: topics of each robot, tf, map, markers, referee and /clock, until Ctrl-C. It needs no ROS.

    ROS nodes use rmw_zenoh; docs/ros.md has what they must set. A match with seats lets none of them in: for it, --to
    names another router.
    """
    from vrg.ros.graph import RosNode
    from vrg.ros.publisher import RosPublisher
    from vrg.ros.wire import ros_name

    match = attached(on)
    namespace = f"/{ros_name(match.name)}"
    robots = {} if match.setup is None else {player.name: player.robot for player in match.setup.players}
    if to is None and not match.endpoint.startswith("tcp/"):
        raise ConfigError(
            f"--to: the router {match.endpoint} of {match.name} lets only seats in, no ROS node: start another one, "
            "`ros2 run rmw_zenoh_cpp rmw_zenohd` or `vrg node router`, and name it here"
        )
    to = to or match.endpoint
    with (
        connected(match.endpoint, on.keys, Seat(SeatKind.WINDOW), Seat(SeatKind.OFFICIAL)) as (stop, session),
        open_session(to, stop=stop) as outside,
    ):
        graph = RosNode(outside, domain, "vrg", namespace)
        setup = match.setup
        driven = [] if setup is None else [player.name for player in setup.players if player.strategy == "ros"]
        node = RosPublisher(
            f"ros-{os.getpid()}",
            Mailbox(),
            Keys(match.name),
            namespace,
            graph.publish,
            robots=robots,
            obstacles=match.obstacles,
            driven={name: graph.commands(f"{namespace}/{ros_name(name)}/cmd_vel") for name in driven},
        )
        console = make_console()
        console.print(f"{match.name} is in ROS 2 as {namespace}, in domain {domain}, by the router {to}.")
        if driven:
            console.print(f"ROS drives {', '.join(driven)} by cmd_vel.")
        run_node(node, session, Keys(match.name), stop)
