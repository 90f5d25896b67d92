"""The command `vrg estop`, which engages or releases the emergency stop and waits until the referee confirms it."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import REASON_LENGTH, Estop, EstopRelease, shortened
from vrg.bus.session import open_session
from vrg.bus.topics import Keys
from vrg.commands.groups import DecisionOptions
from vrg.commands.matches import credentials_for, keys_of, own_match, which_match
from vrg.commands.official import ANSWER_TIMEOUT, Conversation, me, sender
from vrg.errors import BusError
from vrg.launch import running
from vrg.seats.credentials import Credentials, find_credentials_of
from vrg.seats.seat import Seat, SeatKind

STOPPING = sorted(
    {party.kind for party in Keys.estop.speakers} & {party.kind for party in Keys.referee_state.listeners},
    key=lambda kind: (kind is not SeatKind.OFFICIAL, kind),
)
"""The kinds of seats that may engage the emergency stop and hear that the referee confirms it, the official's first."""


def estop(
    on: DecisionOptions,
    release: Annotated[bool, typer.Option("--release", help="Release it; robots stay disarmed until resume.")] = False,
) -> None:
    """Stop every robot at once, of all matches that run here if none is named. It stays so until it is released.

    The keys of any seat will do. Releasing needs those of the official.
    """
    if release:
        targets = [(*own_match(on, "release the emergency stop"), on.keys)]
    else:
        here = running.running() if on.match is None and on.router is None else []
        # One folder, which VRG_KEYS may name, has no keys for the other matches: each match records its own.
        several = [(m.match, m.router, Path(m.keys) if m.keys else on.keys) for m in here]
        targets = several or [(*which_match(on), on.keys)]
    why = shortened(on.reason, REASON_LENGTH)
    order = EstopRelease(by=me(), reason=why) if release else Estop(by=me(), reason=why)
    # All at once, so that no match waits for another one that does not answer.
    with ThreadPoolExecutor(max_workers=len(targets)) as pool:
        asked = [(name, pool.submit(_order_estop, name, at, own, order)) for name, at, own in targets]
        errors = {name: error for name, done in asked if (error := done.exception()) is not None}
    for name, done in asked:
        if name in errors:
            typer.echo(f"{name}: {errors[name]}", err=True)
        elif not release:
            typer.echo(f"{name}: emergency stop engaged")
        elif done.result():
            typer.echo(f"{name}: released: go on with `vrg official resume {name}`")
        else:
            typer.echo(f"{name}: no emergency stop was engaged, so there was nothing to release")
    if errors:
        raise typer.Exit(1)


def _order_estop(name: str, endpoint: str, seats: Path | None, order: Estop | EstopRelease) -> bool:
    """Order an emergency stop, or its release, and wait until the referee has confirmed it.

    Returns:
        False if a release was ordered and no emergency stop was engaged.

    Raises:
        BusError: the router cannot be reached, or the referee does not confirm it.
    """
    credentials = _credentials_for_order(endpoint, seats, order)
    with open_session(endpoint, patience=ANSWER_TIMEOUT, credentials=credentials) as session:
        referee = Conversation(session, Keys(name), Mailbox(sender()))
        if isinstance(order, Estop):
            before = True
            referee.mailbox.publish(referee.keys.estop, order)
        else:
            # Sent in any case: the world may know of a stop of which the referee has not heard yet.
            before = _reports(referee, estop=None) is not False
            referee.mailbox.publish(referee.keys.estop_release, order)
        # It is not for this process to decide that nobody would hear an emergency stop.
        referee.send(at_once=isinstance(order, Estop))
        if _reports(referee, estop=isinstance(order, Estop)) is None:
            raise BusError("sent, but the referee has not confirmed it: is the coordinator running?")
    return before


def _reports(referee: Conversation, *, estop: bool | None) -> bool | None:
    """Wait until the referee reports that an emergency stop is engaged, or is not; with None either will do.

    Returns:
        what it reports; None if it does not in time.
    """

    def engaged() -> bool | None:
        latest = referee.state.latest
        return latest.body.estop if latest is not None and estop in (None, latest.body.estop) else None

    return referee.wait_for(engaged)


def _credentials_for_order(endpoint: str, seats: Path | None, order: Estop | EstopRelease) -> Credentials | None:
    """The keys of a seat that may give an order; None where the router wants none.

    Raises:
        CredentialsError: there are no keys of such a seat.
    """
    if isinstance(order, EstopRelease):
        return credentials_for(endpoint, seats, Seat(SeatKind.OFFICIAL))
    keys = keys_of(endpoint, seats)
    return None if keys is None else find_credentials_of(keys, STOPPING)
