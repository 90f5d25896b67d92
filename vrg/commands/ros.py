"""The command `vrg show ros`, a running match in ROS 2; `vrg play --ros` shares its parts."""

import os
from typing import TYPE_CHECKING, Annotated, Final

import typer

from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached
from vrg.commands.options import listening_address
from vrg.errors import ConfigError

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup

DOMAIN: Final = "ROS_DOMAIN_ID"
BESIDE: Final = 7448
"""The port of the router of ROS nodes beside a match whose own lets only seats in; the next free one if it is taken."""


def ros(
    on: MatchOptions,
    to: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT",
            help="The router of ROS nodes, such as rmw_zenohd's. If none answers there, "
            "one is opened. By default the match's, or one beside it for a match with seats.",
        ),
    ] = None,
    domain: Annotated[int, typer.Option(min=0, max=232, help="The domain of the ROS nodes.", envvar=DOMAIN)] = 0,
) -> None:
    """Let ROS 2 see a match: topics of each robot, tf, map, markers, referee and /clock, until Ctrl-C. It needs no ROS.

    ROS nodes use rmw_zenoh; docs/ros.md has what they must set.
    """
    found = attached(on)
    setup, secured = found.known_setup(), not found.endpoint.startswith("tcp/")
    where = ros_address(domain, to, secured=secured)
    typer.echo(ros_place(setup, where, found.endpoint))
    found.serve("ros", where)


def typed_domain() -> int:
    """The domain in the environment.

    Raises:
        ConfigError: it is none.
    """
    typed = os.environ.get(DOMAIN) or "0"
    if not typed.isdecimal() or int(typed) > 232:
        raise ConfigError(f"{DOMAIN}: expected a whole number from 0 to 232, got {typed!r}")
    return int(typed)


def ros_address(domain: int, to: str | None, *, secured: bool) -> str:
    """The domain and the router of ROS nodes, as `vrg.launch.nodes.ros_node` has it.

    Args:
        to: the router that was typed. secured: True if the match's router lets only seats in.

    Raises:
        LaunchError: no port is free for another router.
    """
    if to is None and secured:
        to = f"tcp/{listening_address(None, BESIDE, 'the router of ROS nodes')}"
    return f"{domain}@{to or ''}"


def ros_place(setup: "MatchSetup", where: str, endpoint: str) -> str:
    """Words on where a match is in ROS 2.

    Args:
        endpoint: of the match's router.
    """
    from vrg.ros.wire import ros_name

    domain, _, router = where.partition("@")
    driven = [player.name for player in setup.players if player.strategy == "ros"]
    drives = f"; cmd_vel drives {', '.join(driven)}" if driven else ""
    return f"in ROS 2: /{ros_name(setup.name)}, domain {domain}, router {router or endpoint}{drives}"
