"""Finds a robot in the graph of ROS 2: the node that obeys its commands, and the one that publishes its odometry."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from vrg.errors import BusError, RobotError
from vrg_ros.wire import Endpoint, Kind, endpoint_of, graph_key, ros_name

if TYPE_CHECKING:
    from vrg.bus.session import Session

TWIST, STAMPED, ODOMETRY = "geometry_msgs/Twist", "geometry_msgs/TwistStamped", "nav_msgs/Odometry"
_NAMED: Final = 12
"""The number of topics that a message names."""


def node_name(player: str) -> str:
    """The name of the node of a player's driver, without its namespace."""
    return f"vrg_{ros_name(player)}"


def no_router(endpoint: str) -> str:
    """Words on a router that does not answer."""
    return (
        f"expected the router of its ROS nodes at {endpoint}, but none answered: start `ros2 run rmw_zenoh_cpp "
        "rmw_zenohd` on its computer, or name another as `router` in [backends.ros]"
    )


def graph_of(session: "Session", domain: int | str) -> list[Endpoint]:
    """The publishers and subscribers of a domain, or of all for `*`; none while the router does not answer."""
    try:
        tokens = session.alive(graph_key(domain))
    except BusError:
        return []
    return [found for token in sorted(tokens) if (found := endpoint_of(token)) is not None]


def met(graph: Sequence[Endpoint], cmd_vel: str, odom: str) -> str:
    """The type of commands that a robot obeys: TWIST or STAMPED.

    Args:
        graph: the endpoints of its domain. cmd_vel, odom: its topics.

    Raises:
        RobotError: it is not there, of a distribution that VRG cannot exchange messages with, or there are two.
    """
    obeyed = _type(graph, Kind.SUBSCRIBER, cmd_vel, (STAMPED, TWIST))
    published = _type(graph, Kind.PUBLISHER, odom, (ODOMETRY,))
    if obeyed and published:
        sources = _nodes(graph, Kind.PUBLISHER, odom)
        if len(sources) > 1:
            raise RobotError(f"expected one node that publishes {odom}, got {' and '.join(sources)}")
        return obeyed
    lacks = [] if obeyed else [f"a node that obeys {cmd_vel}"]
    lacks += [] if published else [f"one that publishes {odom}"]
    topics = sorted({each.topic for each in graph})
    more = " ..." if len(topics) > _NAMED else ""
    seen = f"the topics {', '.join(topics[:_NAMED])}{more}" if topics else "no topic"
    raise RobotError(f"expected {' and '.join(lacks)}, got {seen}")


def commanders(graph: Sequence[Endpoint], cmd_vel: str) -> list[str]:
    """The nodes that command a robot. With the driver's own they would drive it by turns."""
    return _nodes(graph, Kind.PUBLISHER, cmd_vel)


def _nodes(graph: Sequence[Endpoint], kind: Kind, topic: str) -> list[str]:
    return list(dict.fromkeys(each.node for each in graph if (each.kind, each.topic) == (kind, topic)))


def _type(graph: Sequence[Endpoint], kind: Kind, topic: str, of: Sequence[str]) -> str | None:
    """The first of some types for which a topic has an endpoint of a kind.

    Raises:
        RobotError: it has one that VRG cannot exchange messages with.
    """
    there = [each for each in graph if (each.kind, each.topic) == (kind, topic) and each.of in of]
    for each in there:
        if each.trouble:
            raise RobotError(f"{topic}: {each.trouble}")
    return next((each for each in of if any(each == found.of for found in there)), None)
