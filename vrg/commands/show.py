"""The windows and tables of `vrg show`. Each loads what it shows only when it is asked for."""

import contextlib
import ipaddress
import os
import time
from typing import Annotated, Final

import typer
from rich.console import Console

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState
from vrg.bus.process import run_node
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import Session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached, connected, credentials_for, setup_named, which_match
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
from vrg.registry import expected_one_of

AT: Final = "ADDRESS:PORT"
POLL = 0.05
"""The real time in s between two looks at whether the referee has spoken."""


def window(on: MatchOptions, run: RunOption = None) -> None:
    """Watch a match in a window; several may. Closing the window does not end the match."""
    need_display()
    found = attached(on)
    found.serve(SPECTATOR, run=run or found.run)


def hud(player: PlayerArgument, on: MatchOptions) -> None:
    """Open the head-up display of a player: what it knows, and Goto, Manual and Reset by button, key and gamepad."""
    found = attached(on)
    found.known_setup().player(player)
    need_display()
    try:
        found.serve(HUD, player)
    except DuplicateNodeError:
        raise LaunchError(f"{player} has a head-up display already, and a player has only one") from None


def commander(team: TeamArgument, on: MatchOptions) -> None:
    """Command a team with a gamepad or the keyboard: set its priority, or drive one of its players by hand."""
    need_display()
    from vrg.launch.serving import run_window
    from vrg.ui.commander.node import Commander  # pygame takes half a second to load

    found, (seat,) = attached(on), COMMANDER.seats_of(team)
    credentials = credentials_for(found.endpoint, on.keys, seat)
    with connected(found.endpoint, on.keys, seat, patience=10.0) as (stop, session):
        state = first_state(session, found.keys, stop)
        if state is None:
            return
        teams = list(dict.fromkeys(player.team for player in state.players))
        if team not in teams:
            raise LaunchError(f"TEAM: {expected_one_of(teams, team)}")
        own = None if credentials is None else [p.name for p in state.players if p.team == team]
        sizes = {player.name: player.robot.size for player in found.setup.players}
        node = Commander(team, Mailbox(), found.keys, sizes=sizes, obstacles=found.setup.obstacles, seated=own)
        try:
            run_window(node, session, found.keys, stop, gone(found.name, found.endpoint))
        except DuplicateNodeError:
            raise LaunchError(f"the team {team} has a commander already, and a team has only one") from None


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


def first_state(session: Session, keys: Keys, stop: Stop) -> RefereeState | None:
    """The referee's state, as soon as it speaks; None if that was interrupted."""
    mailbox = Mailbox()
    states = mailbox.subscribe(keys.referee_state)
    session.attach(mailbox)
    with Console(stderr=True).status("waiting for the referee"):
        while not stop.is_set():
            session.receive()
            mailbox.handover(0.0)
            if states.latest is not None:
                return states.latest.body
            stop.wait(POLL)
    return None
