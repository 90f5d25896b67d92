"""The windows and tables of `vrg show`. Each loads what it shows only when it is asked for."""

import os
from pathlib import Path
from typing import Annotated

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
from vrg.errors import DuplicateNodeError, LaunchError
from vrg.kinds import COMMANDER, PLAYER, SPECTATOR, Kind
from vrg.seats.seat import Seat, SeatKind

TeamOption = Annotated[
    str | None,
    typer.Option(metavar="TEAM", help="Command this team with a gamepad or the keyboard: its priority, its players."),
]


def window(on: MatchOptions, team: TeamOption = None, run: RunOption = None) -> None:
    """Watch a match in a window, or command a team. Closing the window does not end the match."""
    kind, name = (SPECTATOR, "") if team is None else (COMMANDER, team)
    open_window(on, kind, name, run)


def commander(team: TeamArgument, on: MatchOptions) -> None:
    """Command a team with a gamepad or the keyboard; the same as `vrg show window --team TEAM`."""
    window(on, team=team)


def open_window(on: MatchOptions, kind: Kind, name: str = "", run: Path | None = None) -> None:
    """Show a running match in a window until the window is closed.

    Args:
        name: of the player or the team that a window of this kind is of. run: the run folder, if it is not known.

    Raises:
        LaunchError: there is no display, or the player or the team has such a window.
        ConfigError: it is not clear which match is meant, or there is no such player.
    """
    need_display()
    found = attached(on)
    if kind.named == PLAYER.named:
        found.known_setup().player(name)
    try:
        found.serve(kind, name, run=run or found.run)
    except DuplicateNodeError:
        raise LaunchError(f"the {kind.named} {name} has such a window already; it can have only one") from None


def processes(on: MatchOptions) -> None:
    """Show the processes of a match on all its machines, until Ctrl-C; once if the output is not a terminal."""
    from vrg.ui.processes import ProcessTable

    name, endpoint = which_match(on)
    with connected(endpoint, on.keys, Seat(SeatKind.OFFICIAL), Seat(SeatKind.WINDOW)) as (stop, session):
        node = ProcessTable(f"processes-{os.getpid()}", Mailbox(), Keys(name), console=make_console())
        run_node(node, session, Keys(name), stop, finished=lambda: node.printed, idle=0.5)


def diagram(player: PlayerArgument, match: MatchArgument = None, router: RouterOption = None) -> None:
    """Print the statechart of a player as Mermaid. MATCH may also be a match file, or a game, that is not running."""
    from vrg.agents.charon import mermaid
    from vrg.launch.strategy_class import strategy_of

    setup = (setup_named(match) if match else None) or attached(MatchOptions(match, router)).known_setup()
    strategy = strategy_of(setup, player)
    agent = getattr(strategy, "agent", None)
    if agent is None:
        raise typer.BadParameter(f"{player}'s strategy, {type(strategy).__name__}, is not an automaton")
    typer.echo(mermaid(agent()), nl=False)
