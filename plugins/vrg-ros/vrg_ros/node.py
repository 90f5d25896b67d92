"""What shows a match to ROS 2."""

import logging
from collections import Counter
from collections.abc import Callable

from vrg.bus.mailbox import Mailbox
from vrg.bus.session import Session
from vrg.config.setup import MatchSetup
from vrg.errors import ConfigError
from vrg.launch.context import DISPLAY_PERIOD, Made, NodeContext
from vrg.launch.running import gone
from vrg_ros import DRIVEN, KIND
from vrg_ros.graph import RosNode
from vrg_ros.publisher import RosPublisher
from vrg_ros.wire import ros_name

log = logging.getLogger(__name__)


def ros_node(
    setup: MatchSetup, where: str, join: Callable[[str], Session], *, name: str, official: bool = True
) -> RosPublisher:
    """Make the node that shows a match to ROS 2.

    Args:
        where: the domain, and the router of the ROS nodes, such as `0@tcp/127.0.0.1:7448`; without one it is that of
            the match. join: returns a session with a router; with that of the match if it is empty.
        name: of the node. official: True if the seat of this process may drive players.

    Raises:
        ConfigError: two players have the same name in ROS 2.
    """
    domain, _, router = where.partition("@")
    namespace = f"/{ros_name(setup.name)}"
    graph = RosNode(join(router), int(domain), "vrg", namespace)
    names = Counter(ros_name(player.name) for player in setup.players)
    if alike := [player.name for player in setup.players if names[ros_name(player.name)] > 1]:
        raise ConfigError(f"expected players whose names differ in ROS 2, too, where {', '.join(alike)} are the same")
    wanted = setup.played_by(DRIVEN)
    if wanted and not official:
        log.warning("a window's keys drive no player: cmd_vel of %s needs those of the official", ", ".join(wanted))
    driven = {one: graph.commands(f"{namespace}/{ros_name(one)}/cmd_vel") for one in wanted if official}
    robots = {player.name: player.robot for player in setup.players}
    return RosPublisher(
        name, Mailbox(), setup.keys, namespace, graph, robots=robots, obstacles=setup.obstacles, driven=driven
    )


def ros(on: NodeContext) -> Made:
    """What shows the match to ROS 2."""
    node = ros_node(on.setup, on.name, on.join, name=on.named(KIND.process), official=on.official)
    options = {"idle": DISPLAY_PERIOD}
    return Made(node, options if on.own else {**options, "finished": gone(on.setup.name, on.process.router)})
