"""The commands `vrg official` and `vrg estop`, which send a person's decision and print the referee's answer."""

import getpass
import time
import uuid
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated

import typer

from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import REASON_LENGTH, Call, Estop, Official, OfficialAction, RefereeState
from vrg.bus.names import is_name
from vrg.bus.session import Session, open_session
from vrg.bus.topics import Keys
from vrg.commands.options import EndpointOption, NameOption, own_match, which_match
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


class _Referee:
    """A connection to the referee of a running match."""

    def __init__(self, session: Session, keys: Keys) -> None:
        self._session = session
        self.keys = keys
        self.mailbox = Mailbox()
        self.state: Inlet[RefereeState] = self.mailbox.subscribe(keys.referee_state)
        self.calls: Inlet[Call] = self.mailbox.subscribe(keys.referee_event)
        session.attach(self.mailbox)

    def receive(self) -> None:
        self._session.receive()
        self.mailbox.handover(0.0)

    def send(self) -> None:
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
    reason: str,
    subject: str | None = None,
    value: str | None = None,
) -> None:
    name, endpoint = own_match(match, router, str(action))
    with open_session(endpoint, patience=ANSWER_PATIENCE) as session:
        referee = _Referee(session, Keys(name))
        number = uuid.uuid4().hex
        decision = Official(action=action, by=me(), reason=reason, subject=subject, value=value, id=number)
        referee.mailbox.publish(referee.keys.official, decision)
        referee.send()
        call = referee.answer(number)
    typer.echo(f"{name}: {call.text}")
    if call.rule == "refused":
        raise typer.Exit(1)


@app.command()
def halt(match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = "") -> None:
    """Stop the clock and the robots."""
    _decide(OfficialAction.HALT, match, router, reason)


@app.command()
def resume(match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = "") -> None:
    """Go on after a halt."""
    _decide(OfficialAction.RESUME, match, router, reason)


@app.command()
def end(match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = "") -> None:
    """End the match now."""
    _decide(OfficialAction.END, match, router, reason)


@app.command("set-score")
def set_score(
    team: str, points: int, match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = ""
) -> None:
    """Overrule the score of a team."""
    _decide(OfficialAction.SET_SCORE, match, router, reason, team, str(points))


@app.command("set-role")
def set_role(
    player: str, role: str, match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = ""
) -> None:
    """Overrule the role of a player."""
    _decide(OfficialAction.SET_ROLE, match, router, reason, player, role)


@app.command("set-state")
def set_state(
    player: str, state: str, match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = ""
) -> None:
    """Overrule the state of a player."""
    _decide(OfficialAction.SET_STATE, match, router, reason, player, state)


@app.command()
def disqualify(player: str, match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = "") -> None:
    """Take a player out: its robot stops and stays as an obstacle, and play goes on."""
    _decide(OfficialAction.DISQUALIFY, match, router, reason, player)


@app.command()
def reinstate(player: str, match: NameOption = None, router: EndpointOption = None, reason: ReasonOption = "") -> None:
    """Let a player that is out play again, from the next round."""
    _decide(OfficialAction.REINSTATE, match, router, reason, player)


@app.command()
def place(
    player: Annotated[str, typer.Argument(help="The player whose robot it is.")],
    at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(metavar="X Y HEADING", help="In m and degrees; the default is the player's mark."),
    ] = None,
    match: NameOption = None,
    router: EndpointOption = None,
    reason: ReasonOption = "",
) -> None:
    """Say where a physical robot has been put, so that it counts on from there; put a virtual one there."""
    value = None if at is None else " ".join(f"{number:g}" for number in at)
    _decide(OfficialAction.PLACE, match, router, reason, player, value)


@app.command()
def recover(
    player: Annotated[str | None, typer.Argument(help="The player whose robot it is; all if missing.")] = None,
    match: NameOption = None,
    router: EndpointOption = None,
    reason: ReasonOption = "",
) -> None:
    """Let robots clear the faults that they have latched. Go on with `resume`."""
    _decide(OfficialAction.RECOVER, match, router, reason, player)


def estop(
    release: Annotated[bool, typer.Option("--release", help="Release it; robots stay disarmed until resume.")] = False,
    match: Annotated[
        str | None, typer.Option("--match", help="Name of the match; all that run here if missing.")
    ] = None,
    router: Annotated[str | None, typer.Option("--router", help="Endpoint of its router.")] = None,
    reason: ReasonOption = "",
) -> None:
    """Stop every robot at once, of all matches that run here if none is named. It stays so until it is released."""
    from vrg.launch import running  # only commands on a running match need platformdirs

    if release:
        targets = [own_match(match, router, "release the emergency stop")]
    else:
        several = [(m.match, m.router) for m in running.running()] if match is None and router is None else []
        targets = several or [which_match(match, router)]
    order = Estop(engaged=not release, by=me(), reason=reason)
    # All at once, so that no match waits for another one that does not answer.
    with ThreadPoolExecutor(max_workers=len(targets)) as pool:
        asked = [(name, pool.submit(_order_estop, name, endpoint, order)) for name, endpoint in targets]
        errors = {name: error for name, done in asked if (error := done.exception()) is not None}
    for name, _ in asked:
        if name in errors:
            typer.echo(f"{name}: {errors[name]}", err=True)
        else:
            done = "released: go on with `vrg official resume`" if release else "emergency stop engaged"
            typer.echo(f"{name}: {done}")
    if errors:
        raise typer.Exit(1)


def _order_estop(name: str, endpoint: str, order: Estop) -> None:
    """Order an emergency stop, or its release, and wait until the referee has confirmed it.

    Raises:
        BusError: the router cannot be reached, or the referee does not confirm it.
    """
    with open_session(endpoint, patience=ANSWER_PATIENCE) as session:
        referee = _Referee(session, Keys(name))
        referee.mailbox.publish(referee.keys.estop, order)
        referee.send()
        deadline = time.monotonic() + ANSWER_PATIENCE
        while time.monotonic() < deadline:
            referee.receive()
            latest = referee.state.latest
            if latest is not None and latest.body.estop == order.engaged:
                return
            time.sleep(0.02)
    raise BusError("sent, but the referee has not confirmed it: is the coordinator running?")
