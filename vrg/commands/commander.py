"""The command `vrg commander`, which lets a person command a team of a running match with a gamepad."""

from typing import Annotated

import typer
from rich.console import Console

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import RefereeState
from vrg.bus.process import run_node
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import Session, open_session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.commands.attaching import SetupArgument, attached
from vrg.commands.options import EndpointOption, KeysOption, NameOption, credentials_for, need_display
from vrg.errors import ConfigError, DuplicateNodeError, LaunchError

POLL = 0.05
"""The real time in s between two looks at whether the referee has spoken."""


def commander(
    team: Annotated[str, typer.Option(help="Name of the team to command, such as red.")],
    match: SetupArgument = None,
    name: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
) -> None:
    """Command a team with a gamepad or the keyboard: set its priority, or drive one of its players by hand."""
    from vrg.launch.serving import WINDOW_PERIOD, child_process
    from vrg.ui.commander.node import Commander  # pygame takes half a second to load

    need_display()
    found = attached(match, name, router)
    keys = Keys(found.name)
    credentials = credentials_for(found.endpoint, seats, Seat(SeatKind.COMMANDER, team))
    with (
        child_process(leash=False) as stop,
        open_session(found.endpoint, stop=stop, credentials=credentials) as session,
    ):
        state = first_state(session, keys, stop)
        if state is not None:
            _check_team(state, team)
            own = None if credentials is None else [p.name for p in state.players if p.team == team]
            node = Commander(team, Mailbox(), keys, sizes=found.sizes, obstacles=found.obstacles, seated=own)
            try:
                run_node(node, session, keys, stop, finished=lambda: node.closed, idle=WINDOW_PERIOD)
            except DuplicateNodeError:
                raise LaunchError(f"the team {team} has a commander already, and a team has only one") from None
    if stop.interrupted:
        raise typer.Exit(130)


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


def _check_team(state: RefereeState, team: str) -> None:
    """Raise if there is no such team.

    Raises:
        ConfigError: no player of the match is in it.
    """
    teams = list(dict.fromkeys(player.team for player in state.players))
    if team not in teams:
        raise ConfigError([f"expected a team of this match ({', '.join(teams)}), got {team!r}"])
