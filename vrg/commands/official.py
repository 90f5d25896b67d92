"""The command `vrg official`, which sends a person's decision and prints the answer of the referee or the launcher."""

import getpass
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from vrg.bus.access import DECIDING
from vrg.bus.mailbox import Inlet, Mailbox
from vrg.bus.messages import REASON_LENGTH, Official, OfficialAction, RefereeState, SeatRequest, shortened
from vrg.bus.node import sender_of
from vrg.bus.session import Session
from vrg.bus.topics import Keys
from vrg.commands.groups import CommandGroup, DecisionOptions, MatchOptions
from vrg.commands.matches import connected, own_match
from vrg.commands.options import PlayerArgument, PoseOption, StrategyArgument, TeamArgument
from vrg.config.targets import whole_target
from vrg.errors import BusError, ConfigError
from vrg.names import is_name
from vrg.seats.seat import Seat, SeatKind

T = TypeVar("T")

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


class Conversation:
    """A connection to a running match, on which a command asks and waits for an answer.

    Args:
        mailbox: what is published there is sent by `send`. Its subscriptions must have been made.
        patience: the real time in s to wait for a listener and for an answer.

    Attributes:
        state: the referee's.
    """

    def __init__(self, session: Session, keys: Keys, mailbox: Mailbox, patience: float = ANSWER_TIMEOUT) -> None:
        self._session = session
        self._patience = patience
        self.keys = keys
        self.mailbox = mailbox
        self.state: Inlet[RefereeState] = self.mailbox.subscribe(keys.referee_state)
        session.attach(self.mailbox)

    def send(self, advice: str = "is it running?", *, at_once: bool = False) -> None:
        """Send what was published.

        Args:
            at_once: send it now, and again once a node listens.

        Raises:
            BusError: no node listens to it in time; the message ends with the advice.
        """
        out = self.mailbox.collect()
        if at_once:
            self._session.send(out)
        for item in out:
            if not self._session.wait_for_listener(item.message.key, item.topic.qos, self._patience):
                raise BusError(f"no node of match {self.keys.match!r} listens to {item.message.key}: {advice}")
        self._session.send(out)

    def wait_for(self, look: Callable[[], T | None]) -> T | None:
        """Receive messages until a look at them finds something, and return that; None if it does not in time."""
        deadline = time.monotonic() + self._patience
        while time.monotonic() < deadline:
            self._session.receive()
            self.mailbox.handover(0.0)
            if (found := look()) is not None:
                return found
            time.sleep(0.02)
        return None


def _decide(action: OfficialAction, on: DecisionOptions, subject: str | None = None, value: str | None = None) -> None:
    name, endpoint = own_match(on, str(action))
    with connected(endpoint, on.keys, OFFICIAL, patience=ANSWER_TIMEOUT) as (_, session):
        bus, mailbox, number = Keys(name), Mailbox(sender()), uuid.uuid4().hex
        calls = mailbox.subscribe(bus.referee_event)
        referee = Conversation(session, bus, mailbox)
        why = shortened(on.reason, REASON_LENGTH)
        decision = Official(action=action, by=me(), reason=why, subject=subject, value=value, id=number)
        mailbox.publish(bus.official, decision)
        referee.send()
        call = referee.wait_for(lambda: next((c.body for c in calls.take() if c.body.answers == number), None))
    if call is None:
        raise BusError(f"the referee of match {name!r} did not answer within {ANSWER_TIMEOUT:g} s")
    typer.echo(f"{name}: {call.text}")
    if call.rule == "refused":
        if referee.state.latest is not None and referee.state.latest.body.estop:
            typer.echo(
                f"`vrg estop --release {name}` releases the stop; then `vrg official resume {name}` continues play."
            )
        raise typer.Exit(1)


@app.command()
def halt(on: DecisionOptions) -> None:
    """Stop the clock and the robots."""
    _decide(OfficialAction.HALT, on)


@app.command()
def resume(on: DecisionOptions) -> None:
    """Continue after a halt."""
    _decide(OfficialAction.RESUME, on)


@app.command()
def end(on: DecisionOptions) -> None:
    """End the match now."""
    _decide(OfficialAction.END, on)


@app.command("set-score")
def set_score(
    team: TeamArgument,
    points: Annotated[int, typer.Argument(metavar="POINTS", help="The team's new score.")],
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
def disqualify(player: PlayerArgument, on: DecisionOptions) -> None:
    """Take a player out: its robot stops and stays as an obstacle, and play goes on."""
    _decide(OfficialAction.DISQUALIFY, on, player)


@app.command()
def reinstate(player: PlayerArgument, on: DecisionOptions) -> None:
    """Let a player that is out play again, from the next round."""
    _decide(OfficialAction.REINSTATE, on, player)


@app.command()
def place(player: PlayerArgument, on: DecisionOptions, pose: PoseOption = None) -> None:
    """Say where a physical robot has been put, so that it continues from there; put a virtual one there.

    Without --pose, the place is the player's mark.
    """
    value = None if pose is None else " ".join(f"{number:g}" for number in pose)
    _decide(OfficialAction.PLACE, on, player, value)


@app.command()
def recover(
    player: Annotated[str, typer.Argument(metavar="[PLAYER|all]", help="Whose robot; by default, all.")] = "all",
    on: DecisionOptions = _ANY,
) -> None:
    """Let robots clear the faults that they have latched. Then continue with `resume`."""
    _decide(OfficialAction.RECOVER, on, None if player == "all" else player)


@app.command()
def substitute(player: PlayerArgument, strategy: StrategyArgument, on: MatchOptions) -> None:
    """Let a player continue with another strategy, or with a fixed one. A disqualified player plays again.

    Its process is replaced. A player that is out because it failed returns in the next round.
    """
    name, endpoint = own_match(on, f"let {player} play with {strategy}")
    from vrg.playing.trial import trial  # it loads what checks match files

    target = whole_target(strategy)
    with trial() as tried:
        tried.find(target, Path.cwd())  # a mistake is reported before the old player is stopped
    with connected(endpoint, on.keys, OFFICIAL, patience=_SUBSTITUTING) as (_, session):
        bus, mailbox, number = Keys(name), Mailbox(sender()), uuid.uuid4().hex
        answers = mailbox.subscribe(bus.seat_answer)
        launcher = Conversation(session, bus, mailbox, _SUBSTITUTING)
        request = SeatRequest(player=player, strategy=target, by=me(), id=number)
        mailbox.publish(bus.seat_request, request)
        launcher.send("no `vrg play` runs it there: if its processes were started by hand, use `vrg node player`")
        answer = launcher.wait_for(lambda: next((a.body for a in answers.take() if a.body.id == number), None))
    if answer is None:
        raise BusError(f"the launcher of match {name} did not answer within {_SUBSTITUTING:g} s")
    if answer.refused is not None:
        raise ConfigError([answer.refused])
    typer.echo(f"{name}: {player} now plays with {strategy}")
