"""The command `vrg show ros`, a running match in ROS 2, and where `vrg play --show ros` shows one."""

import os
from typing import TYPE_CHECKING, Annotated, Final

import typer

from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached, credentials_for
from vrg.commands.options import listening_address
from vrg.errors import ConfigError
from vrg.kinds import Opening
from vrg.seats.credentials import is_official
from vrg_ros import DRIVEN, KIND
from vrg_ros.settings import router_of
from vrg_ros.wire import ros_name

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
    """Let ROS 2 see a match until it ends: topics of each robot, tf, map, markers, referee, /clock. It needs no ROS.

    ROS nodes use rmw_zenoh; the README of vrg-ros has what they must set.
    """
    found = attached(on)
    setup, secured = found.known_setup(), not found.endpoint.startswith("tcp/")
    where = ros_address(domain, to, secured=secured)
    official = is_official(credentials_for(found.endpoint, on.keys, *KIND.seats_of("")))
    typer.echo(ros_place(setup, where, found.endpoint, drives=official))
    found.serve(KIND, where)


def open_ros(setup: "MatchSetup", typed: str | None, *, secured: bool) -> Opening:
    """Where ROS 2 sees a match, in the domain of the environment; see `vrg.kinds.Kind` and `ros_address`."""
    where = ros_address(typed_domain(), typed, secured=secured)
    return Opening(where, lambda endpoint: ros_place(setup, where, endpoint))


def typed_domain() -> int:
    """The domain in the environment.

    Raises:
        ConfigError: it is not one.
    """
    typed = os.environ.get(DOMAIN) or "0"
    if not typed.isdecimal() or int(typed) > 232:
        raise ConfigError(f"{DOMAIN}: expected a whole number from 0 to 232, got {typed!r}")
    return int(typed)


def ros_address(domain: int, to: str | None, *, secured: bool) -> str:
    """The domain and the router of ROS nodes, as `vrg_ros.node` has it.

    Args:
        to: the router that was typed. secured: True if the match's router lets only seats in.

    Raises:
        ConfigError: `to` is no router that ROS nodes can connect to.
        LaunchError: no port is free for another router.
    """
    if to is None:
        to = f"tcp/{listening_address(None, BESIDE, 'the router of ROS nodes')}" if secured else ""
    else:
        try:
            router_of(to)
        except ValueError as error:
            raise ConfigError(f"the router of ROS nodes: {error}") from None
    return f"{domain}@{to}"


def ros_place(setup: "MatchSetup", where: str, endpoint: str, *, drives: bool = True) -> str:
    """Words on where a match is in ROS 2.

    Args:
        endpoint: of the match's router. drives: True if ROS may drive players.
    """
    domain, _, router = where.partition("@")
    router = router or endpoint
    words = f"in ROS 2: /{ros_name(setup.name)}, domain {domain}, router {router}"
    if driven := setup.played_by(DRIVEN):
        words += f"; cmd_vel drives {', '.join(driven)}" if drives else "; a window's keys drive no player"
    if router != DEFAULT_ENDPOINT:
        reached = router.replace("0.0.0.0", "ADDRESS").replace("[::]", "ADDRESS")
        words += f"""
  for ROS nodes: export ZENOH_CONFIG_OVERRIDE='mode="client";connect/endpoints=["{reached}"]'"""
    return words
