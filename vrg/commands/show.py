"""The windows and tables of `vrg show`. Each loads what it shows only when it is asked for."""

import contextlib
import ipaddress
import os
import time
from typing import Annotated, Final

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.process import run_node
from vrg.bus.topics import Keys
from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached, connected, setup_named, which_match
from vrg.commands.options import (
    MatchArgument,
    PlayerArgument,
    RouterOption,
    RunOption,
    TeamArgument,
    make_console,
    need_display,
)
from vrg.errors import ConfigError, DuplicateNodeError, LaunchError
from vrg.kinds import COMMANDER, HUD, SPECTATOR
from vrg.launch.running import gone
from vrg.seats.seat import Seat, SeatKind

AT: Final = "ADDRESS:PORT"
TeamOption = Annotated[
    str | None,
    typer.Option(metavar="TEAM", help="Command this team with a gamepad or the keyboard: its priority, its players."),
]
HudOption = Annotated[
    str | None,
    typer.Option(metavar="PLAYER", help="What this player knows; Goto, Manual and Reset by button, key and gamepad."),
]


def window(on: MatchOptions, team: TeamOption = None, hud: HudOption = None, run: RunOption = None) -> None:
    """Watch a match in a window, command a team, or drive one player. Closing the window does not end the match."""
    if team is not None and hud is not None:
        raise LaunchError("--team and --hud: expected one of them, got both: a second window can have the other")
    need_display()
    found, kind, name = attached(on), SPECTATOR, ""
    if team is not None:
        kind, name = COMMANDER, team
    elif hud is not None:
        kind, name = HUD, found.known_setup().player(hud).name
    try:
        found.serve(kind, name, run=run or found.run)
    except DuplicateNodeError:
        raise LaunchError(f"the {kind.named} {name} has such a window already, and only one at a time") from None


def hud(player: PlayerArgument, on: MatchOptions) -> None:
    """Open the head-up display of a player; the same as `vrg show window --hud PLAYER`."""
    window(on, hud=player)


def commander(team: TeamArgument, on: MatchOptions) -> None:
    """Command a team with a gamepad or the keyboard; the same as `vrg show window --team TEAM`."""
    window(on, team=team)


def ssl(
    on: MatchOptions,
    vision: Annotated[str, typer.Option(metavar=AT, help="Where packets of vision are sent.")] = "224.5.23.2:10006",
    tracker: Annotated[str, typer.Option(metavar=AT, help="Where a tracker's are sent.")] = "224.5.23.2:10010",
    referee: Annotated[str, typer.Option(metavar=AT, help="Where a game controller's are sent.")] = "224.5.23.1:10003",
    interface: Annotated[str, typer.Option(help="Address of this computer's network interface to send by.")] = "",
    ttl: Annotated[int, typer.Option(min=1, max=255, help="Hops of multicast packets; vision itself uses 32.")] = 1,
) -> None:
    """Let the tools of the RoboCup Small Size League see a match: vision, tracker and referee, until it ends."""
    from vrg.localisation.ssl.network import Sender
    from vrg.localisation.ssl.publisher import SslPublisher

    addresses = {"vision": _address(vision), "tracker": _address(tracker), "referee": _address(referee)}
    name, endpoint = which_match(on)
    with (
        connected(endpoint, on.keys, Seat(SeatKind.WINDOW), Seat(SeatKind.OFFICIAL)) as (stop, session),
        contextlib.closing(Sender(addresses, interface, ttl)) as sender,
    ):
        node = SslPublisher(f"ssl-{os.getpid()}", Mailbox(), Keys(name), sender.send, time.time)
        make_console().print(f"{name}: vision at {vision}, tracker at {tracker}, referee at {referee}", soft_wrap=True)
        run_node(node, session, Keys(name), stop, finished=gone(name, endpoint))


def _address(text: str) -> tuple[str, int]:
    """An address and a port of a text such as `224.5.23.2:10006`.

    Raises:
        ConfigError: it is none.
    """
    host, _, port = text.rpartition(":")
    try:
        ipaddress.IPv4Address(host)
        if not 0 < int(port) < 65536:
            raise ValueError
    except ValueError:
        raise ConfigError(f"expected an address and a port, such as 224.5.23.2:10006, got {text!r}") from None
    return host, int(port)


def processes(on: MatchOptions) -> None:
    """Show the processes of a match on all its machines, until Ctrl-C; once, where the output is no terminal."""
    from vrg.ui.processes import ProcessTable

    name, endpoint = which_match(on)
    with connected(endpoint, on.keys, Seat(SeatKind.OFFICIAL), Seat(SeatKind.WINDOW)) as (stop, session):
        node = ProcessTable(f"processes-{os.getpid()}", Mailbox(), Keys(name), console=make_console())
        run_node(node, session, Keys(name), stop, finished=lambda: node.printed, idle=0.5)


def diagram(player: PlayerArgument, match: MatchArgument = None, router: RouterOption = None) -> None:
    """Print the statechart of a player as Mermaid. MATCH may also be a match file, or a game, that does not run."""
    from vrg.agents.diagram import mermaid
    from vrg.launch.nodes.strategy import strategy_of

    setup = (setup_named(match) if match else None) or attached(MatchOptions(match, router)).known_setup()
    strategy = strategy_of(setup, player)
    agent = getattr(strategy, "agent", None)
    if agent is None:
        raise typer.BadParameter(f"{player}'s strategy, {type(strategy).__name__}, is no automaton")
    typer.echo(mermaid(agent()), nl=False)
