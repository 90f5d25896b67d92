"""The command `vrg official`, which sends a person's decision and prints the referee's answer."""

import getpass
import time
import uuid
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.access import DECIDING
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import REASON_LENGTH, Call, Official, OfficialAction, RefereeState, shortened
from vrg.bus.names import is_name
from vrg.bus.node import sender_of
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import Session, open_session
from vrg.bus.topics import Keys
from vrg.commands.options import EndpointOption, KeysOption, NameOption, credentials_for, own_match
from vrg.errors import BusError

app = typer.Typer(no_args_is_help=True, help="Decide as an official: halt, resume, end, overrule, recover robots.")

ANSWER_PATIENCE = 3.0
"""The real time in s to wait for the referee's answer."""


def _short(reason: str) -> str:
    if len(reason) > REASON_LENGTH:
        raise typer.BadParameter(f"expected at most {REASON_LENGTH} characters, got {len(reason)}")
    return reason


ReasonOption = Annotated[str, typer.Option("--reason", callback=_short, help="The reason, for the journal.")]


def me() -> str:
    """Who decides: the user's name."""
    try:
        name = getpass.getuser()
    except (KeyError, OSError):
        return "official"
    return name if is_name(name) else "official"


def sender() -> str:
    """What stands in the messages of a command, as of a node."""
    return sender_of(DECIDING, me())


class Referee:
    """A connection to the referee of a running match."""

    def __init__(self, session: Session, keys: Keys) -> None:
        self._session = session
        self.keys = keys
        self.mailbox = Mailbox(sender())
        self.state: Inlet[RefereeState] = self.mailbox.subscribe(keys.referee_state)
        self.calls: Inlet[Call] = self.mailbox.subscribe(keys.referee_event)
        session.attach(self.mailbox)

    def receive(self) -> None:
        """Take in what the referee has said since the last call."""
        self._session.receive()
        self.mailbox.handover(0.0)

    def send(self) -> None:
        """Send what was published.

        Raises:
            BusError: nobody listens to it within ANSWER_PATIENCE.
        """
        out = self.mailbox.collect()
        for item in out:
            if not self._session.wait_for_listener(item.message.key, item.topic.qos, ANSWER_PATIENCE):
                raise BusError(f"nobody in match {self.keys.match!r} listens to {item.message.key}: is it running?")
        self._session.send(out)

    def answer(self, number: str) -> Call:
        """Wait for the referee's call that answers the decision with this id.

        Raises:
            BusError: the referee does not answer within ANSWER_PATIENCE.
        """
        deadline = time.monotonic() + ANSWER_PATIENCE
        while time.monotonic() < deadline:
            self.receive()
            for received in self.calls.take():
                if received.body.answers == number:
                    return received.body
            time.sleep(0.02)
        raise BusError(f"the referee of match {self.keys.match!r} did not answer within {ANSWER_PATIENCE:g} s")


def _decide(
    action: OfficialAction,
    match: str | None,
    router: str | None,
    seats: Path | None,
    reason: str,
    subject: str | None = None,
    value: str | None = None,
) -> None:
    name, endpoint = own_match(match, router, str(action))
    credentials = credentials_for(endpoint, seats, Seat(SeatKind.OFFICIAL))
    with open_session(endpoint, patience=ANSWER_PATIENCE, credentials=credentials) as session:
        referee = Referee(session, Keys(name))
        number = uuid.uuid4().hex
        why = shortened(reason, REASON_LENGTH)
        decision = Official(action=action, by=me(), reason=why, subject=subject, value=value, id=number)
        referee.mailbox.publish(referee.keys.official, decision)
        referee.send()
        call = referee.answer(number)
    typer.echo(f"{name}: {call.text}")
    if call.rule == "refused":
        raise typer.Exit(1)


@app.command()
def halt(
    match: NameOption = None, router: EndpointOption = None, seats: KeysOption = None, reason: ReasonOption = ""
) -> None:
    """Stop the clock and the robots."""
    _decide(OfficialAction.HALT, match, router, seats, reason)


@app.command()
def resume(
    match: NameOption = None, router: EndpointOption = None, seats: KeysOption = None, reason: ReasonOption = ""
) -> None:
    """Go on after a halt."""
    _decide(OfficialAction.RESUME, match, router, seats, reason)


@app.command()
def end(
    match: NameOption = None, router: EndpointOption = None, seats: KeysOption = None, reason: ReasonOption = ""
) -> None:
    """End the match now."""
    _decide(OfficialAction.END, match, router, seats, reason)


@app.command("set-score")
def set_score(
    team: str,
    points: int,
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    reason: ReasonOption = "",
) -> None:
    """Overrule the score of a team."""
    _decide(OfficialAction.SET_SCORE, match, router, seats, reason, team, str(points))


@app.command("set-role")
def set_role(
    player: str,
    role: str,
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    reason: ReasonOption = "",
) -> None:
    """Overrule the role of a player."""
    _decide(OfficialAction.SET_ROLE, match, router, seats, reason, player, role)


@app.command("set-state")
def set_state(
    player: str,
    state: str,
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    reason: ReasonOption = "",
) -> None:
    """Overrule the state of a player."""
    _decide(OfficialAction.SET_STATE, match, router, seats, reason, player, state)


@app.command()
def disqualify(
    player: str,
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    reason: ReasonOption = "",
) -> None:
    """Take a player out: its robot stops and stays as an obstacle, and play goes on."""
    _decide(OfficialAction.DISQUALIFY, match, router, seats, reason, player)


@app.command()
def reinstate(
    player: str,
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    reason: ReasonOption = "",
) -> None:
    """Let a player that is out play again, from the next round."""
    _decide(OfficialAction.REINSTATE, match, router, seats, reason, player)


@app.command()
def place(
    player: Annotated[str, typer.Argument(help="The player whose robot it is.")],
    at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="X Y HEADING", help="In m and degrees; the default is the player's mark."),
    ] = None,
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    reason: ReasonOption = "",
) -> None:
    """Say where a physical robot has been put, so that it counts on from there; put a virtual one there."""
    value = None if at is None else " ".join(f"{number:g}" for number in at)
    _decide(OfficialAction.PLACE, match, router, seats, reason, player, value)


@app.command()
def recover(
    player: Annotated[str | None, typer.Argument(help="The player whose robot it is; all if missing.")] = None,
    match: NameOption = None,
    router: EndpointOption = None,
    seats: KeysOption = None,
    reason: ReasonOption = "",
) -> None:
    """Let robots clear the faults that they have latched. Go on with `resume`."""
    _decide(OfficialAction.RECOVER, match, router, seats, reason, player)
