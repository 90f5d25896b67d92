"""The command `vrg substitute`, which puts another player into a seat while the match runs."""

import time
import uuid
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import SeatRequest
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.commands.official import me, sender
from vrg.commands.options import EndpointOption, KeysOption, credentials_for, which_match, whole_target
from vrg.errors import BusError, ConfigError

_PATIENCE = 10.0
"""The real time in s to wait for the launcher, which gives the old player time to stop its robot."""


def substitute(
    match: Annotated[str, typer.Argument(help="Name of the running match.")],
    player: Annotated[str, typer.Argument(help="Name of the player.")],
    strategy: Annotated[str, typer.Argument(help="What it plays by from now on, such as mine.py:Mine.")],
    router: EndpointOption = None,
    seats: KeysOption = None,
) -> None:
    """Let a player go on with another strategy, or with the mended one. One that was disqualified plays again.

    Its process is replaced. A player that is out because it has failed is back from the next round.
    """
    from vrg.launch.trial import trial  # it loads what checks match files

    target = whole_target(strategy)
    with trial() as tried:
        tried.find(target, Path.cwd())  # a mistake is told before the old player is stopped
    name, endpoint = which_match(match, router)
    keys, mailbox, number = Keys(name), Mailbox(sender()), uuid.uuid4().hex
    answers = mailbox.subscribe(keys.seat_answer)
    credentials = credentials_for(endpoint, seats, Seat(SeatKind.OFFICIAL))
    with open_session(endpoint, patience=_PATIENCE, credentials=credentials) as session:
        session.attach(mailbox)
        mailbox.publish(keys.seat_request, SeatRequest(player=player, strategy=target, by=me(), id=number))
        for out in (sent := mailbox.collect()):
            if not session.wait_for_listener(out.message.key, out.topic.qos, _PATIENCE):
                raise BusError(
                    f"no `vrg play` runs a match with the name {name} there; if its processes were started by hand, "
                    "use `vrg player`"
                )
        session.send(sent)
        deadline = time.monotonic() + _PATIENCE
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
    raise BusError(f"the launcher of match {name} did not answer within {_PATIENCE:g} s")
