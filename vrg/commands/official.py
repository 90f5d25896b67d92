"""The command `vrg official`, which sends a person's decision and prints the answer of the referee or the launcher."""

import getpass
import time
import uuid
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.access import DECIDING
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import REASON_LENGTH, Call, Official, OfficialAction, RefereeState, SeatRequest, shortened
from vrg.bus.names import is_name
from vrg.bus.node import sender_of
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import Session
from vrg.bus.topics import Keys
from vrg.commands.groups import CommandGroup, DecisionOptions, MatchOptions
from vrg.commands.matches import connected, own_match
from vrg.commands.options import PlayerArgument, PoseOption, StrategyArgument, TeamArgument, whole_target
from vrg.errors import BusError, ConfigError

app = CommandGroup(no_args_is_help=True)

ANSWER_TIMEOUT = 3.0
"""The real time in s to wait for the referee's answer."""


_SUBSTITUTING = 10.0
"""The real time in s to wait for the launcher, which gives the old player time to stop its robot."""

OFFICIAL = Seat(SeatKind.OFFICIAL)
_ANY = DecisionOptions()


def me() -> str:
    """The name of the user, who decides."""
    try:
        name = getpass.getuser()
    except (KeyError, OSError):
        return "official"
    return name if is_name(name) else "official"


def sender() -> str:
    """The sender in the messages of a command, as of a node."""
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
        """Take in the referee's answers since the last call."""
        self._session.receive()
        self.mailbox.handover(0.0)

    def send(self) -> None:
        """Send what was published.

        Raises:
            BusError: no referee listens to it within ANSWER_TIMEOUT.
        """
        out = self.mailbox.collect()
        for item in out:
            if not self._session.wait_for_listener(item.message.key, item.topic.qos, ANSWER_TIMEOUT):
                raise BusError(f"no node of match {self.keys.match!r} listens to {item.message.key}: is it running?")
        self._session.send(out)

    def answer(self, number: str) -> Call:
        """Wait for the referee's call that answers the decision with this id.

        Raises:
            BusError: the referee does not answer within ANSWER_TIMEOUT.
        """
        deadline = time.monotonic() + ANSWER_TIMEOUT
        while time.monotonic() < deadline:
            self.receive()
            for received in self.calls.take():
                if received.body.answers == number:
                    return received.body
            time.sleep(0.02)
        raise BusError(f"the referee of match {self.keys.match!r} did not answer within {ANSWER_TIMEOUT:g} s")


def _decide(
    action: OfficialAction,
    on: DecisionOptions,
    subject: str | None = None,
    value: str | None = None,
) -> None:
    name, endpoint = own_match(on, str(action))
    with connected(endpoint, on.keys, OFFICIAL, patience=ANSWER_TIMEOUT) as (_, session):
        referee = Referee(session, Keys(name))
        number = uuid.uuid4().hex
        why = shortened(on.reason, REASON_LENGTH)
        decision = Official(action=action, by=me(), reason=why, subject=subject, value=value, id=number)
        referee.mailbox.publish(referee.keys.official, decision)
        referee.send()
        call = referee.answer(number)
    typer.echo(f"{name}: {call.text}")
    if call.rule == "refused":
        if referee.state.latest is not None and referee.state.latest.body.estop:
            typer.echo("`vrg estop --release` releases the emergency stop; then `vrg official resume` continues play.")
        raise typer.Exit(1)


@app.command()
def halt(on: DecisionOptions) -> None:
    """Stop the clock and the robots."""
    _decide(OfficialAction.HALT, on)


@app.command()
def resume(on: DecisionOptions) -> None:
    """Go on after a halt."""
    _decide(OfficialAction.RESUME, on)


@app.command()
def end(on: DecisionOptions) -> None:
    """End the match now."""
    _decide(OfficialAction.END, on)


@app.command("set-score")
def set_score(
    team: TeamArgument,
    points: Annotated[int, typer.Argument(metavar="POINTS", help="Its score from now on.")],
    on: DecisionOptions,
) -> None:
    """Overrule the score of a team."""
    _decide(OfficialAction.SET_SCORE, on, team, str(points))


@app.command("set-role")
def set_role(
    player: PlayerArgument,
    role: Annotated[str, typer.Argument(metavar="ROLE", help="A role of the game.")],
    on: DecisionOptions,
) -> None:
    """Overrule the role of a player."""
    _decide(OfficialAction.SET_ROLE, on, player, role)


@app.command("set-state")
def set_state(
    player: PlayerArgument,
    state: Annotated[str, typer.Argument(metavar="STATE", help="A state of the game.")],
    on: DecisionOptions,
) -> None:
    """Overrule the state of a player."""
    _decide(OfficialAction.SET_STATE, on, player, state)


@app.command()
def disqualify(
    player: PlayerArgument,
    on: DecisionOptions,
) -> None:
    """Take a player out: its robot stops and stays as an obstacle, and play goes on."""
    _decide(OfficialAction.DISQUALIFY, on, player)


@app.command()
def reinstate(
    player: PlayerArgument,
    on: DecisionOptions,
) -> None:
    """Let a player that is out play again, from the next round."""
    _decide(OfficialAction.REINSTATE, on, player)


@app.command()
def place(
    player: PlayerArgument,
    on: DecisionOptions,
    pose: PoseOption = None,
) -> None:
    """Tell where a physical robot has been put, so that it counts on from there; put a virtual one there.

    Without --pose that is the player's mark.
    """
    value = None if pose is None else " ".join(f"{number:g}" for number in pose)
    _decide(OfficialAction.PLACE, on, player, value)


@app.command()
def recover(
    player: Annotated[str, typer.Argument(metavar="[PLAYER|all]", help="Whose robot; all if missing.")] = "all",
    on: DecisionOptions = _ANY,
) -> None:
    """Let robots clear the faults that they have latched. Go on with `resume`."""
    _decide(OfficialAction.RECOVER, on, None if player == "all" else player)


@app.command()
def substitute(
    player: PlayerArgument,
    strategy: StrategyArgument,
    options: MatchOptions,
) -> None:
    """Let a player go on with another strategy, or with the mended one. One that was disqualified plays again.

    Its process is replaced. A player that is out because it has failed is back from the next round.
    """
    name, endpoint = own_match(options, f"let {player} play by {strategy}")
    from vrg.launch.trial import trial  # it loads what checks match files

    target = whole_target(strategy)
    with trial() as tried:
        tried.find(target, Path.cwd())  # a mistake is reported before the old player is stopped
    on, mailbox, number = Keys(name), Mailbox(sender()), uuid.uuid4().hex
    answers = mailbox.subscribe(on.seat_answer)
    with connected(endpoint, options.keys, OFFICIAL, patience=_SUBSTITUTING) as (_, session):
        session.attach(mailbox)
        mailbox.publish(on.seat_request, SeatRequest(player=player, strategy=target, by=me(), id=number))
        for out in (sent := mailbox.collect()):
            if not session.wait_for_listener(out.message.key, out.topic.qos, _SUBSTITUTING):
                raise BusError(
                    f"no `vrg play` runs a match with the name {name} there; if its processes were started by hand, "
                    "use `vrg node player`"
                )
        session.send(sent)
        deadline = time.monotonic() + _SUBSTITUTING
        while time.monotonic() < deadline:
            session.receive()
            mailbox.handover(0.0)
            for received in answers.take():
                if received.body.id == number:
                    if received.body.refused is not None:
                        raise ConfigError([received.body.refused])
                    typer.echo(f"{name}: {player} plays by {strategy} now")
                    return
            time.sleep(0.02)
    raise BusError(f"the launcher of match {name} did not answer within {_SUBSTITUTING:g} s")
