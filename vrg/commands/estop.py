"""The command `vrg estop`, which engages or releases the emergency stop and waits until the referee confirms it."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from vrg.bus.mailbox import Mailbox
from vrg.bus.messages import REASON_LENGTH, Estop, EstopRelease, shortened
from vrg.bus.session import Session, open_session
from vrg.bus.topics import Keys
from vrg.commands.groups import DecisionOptions
from vrg.commands.matches import credentials_for, folders_of_keys, own_match, which_match
from vrg.commands.official import ANSWER_TIMEOUT, OFFICIAL, Conversation, me, sender
from vrg.errors import BusError, CredentialsError
from vrg.launch import running
from vrg.seats.credentials import Credentials, credentials_of
from vrg.seats.seat import SeatKind

STOPPING = sorted(
    {party.kind for party in Keys.estop.speakers} & {party.kind for party in Keys.referee_state.listeners},
    key=lambda kind: (kind is not SeatKind.OFFICIAL, kind),
)
"""The kinds of seats that may engage the emergency stop and hear that the referee confirms it, the official's first."""


def estop(
    on: DecisionOptions,
    release: Annotated[bool, typer.Option("--release", help="Release it; robots stay disarmed until resumed.")] = False,
) -> None:
    """Stop every robot at once, in all matches that run here unless one is named. The stop lasts until it is released.

    The keys of any seat will do, and the command tries all that it finds. Releasing the stop needs the official's keys.
    """
    if release:
        targets = [own_match(on, "release the emergency stop")]
    else:
        here = running.running()
        meant = [(m.match, m.router) for m in here if on.match in (None, m.match) and on.router in (None, m.router)]
        targets = meant or [which_match(on)]
    why = shortened(on.reason, REASON_LENGTH)
    order = EstopRelease(by=me(), reason=why) if release else Estop(by=me(), reason=why)
    # All at once, so that no match waits for another one that does not answer.
    with ThreadPoolExecutor(max_workers=len(targets)) as pool:
        asked = [(name, pool.submit(_order_estop, name, at, on.keys, order)) for name, at in targets]
    for name, done in asked:
        if (error := done.exception()) is not None:
            typer.echo(f"{name}: {error}", err=True)
        elif not release:
            typer.echo(f"{name}: emergency stop engaged")
        elif done.result():
            typer.echo(f"{name}: released: continue with `vrg official resume {name}`")
        else:
            typer.echo(f"{name}: no emergency stop was engaged, so there was nothing to release")
    if any(done.exception() for _, done in asked):
        raise typer.Exit(1)


def _order_estop(name: str, endpoint: str, typed_keys: Path | None, order: Estop | EstopRelease) -> bool:
    """Order an emergency stop, or its release, and wait until the referee has confirmed it.

    Args:
        typed_keys: the folder of keys that was typed, if one was.

    Returns:
        False if a release was ordered and no emergency stop was engaged.

    Raises:
        BusError: the router cannot be reached, or the referee does not confirm it.
    """
    with ExitStack() as stack:
        session = _link(stack, endpoint, typed_keys, order)
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


def _link(stack: ExitStack, endpoint: str, typed_keys: Path | None, order: Estop | EstopRelease) -> Session:
    """Open a session with the router until the stack ends. For an emergency stop it is opened in any way that works.

    Raises:
        BusError: no way leads to the router. CredentialsError: there are no keys of a seat that may release.
    """
    problems: list[str] = []
    silent = set()
    for at, credentials in _ways(endpoint, typed_keys, order, problems):
        try:
            if at not in silent:
                return stack.enter_context(open_session(at, patience=ANSWER_TIMEOUT, credentials=credentials))
        except BusError as error:
            problems.append(str(error))
            if not isinstance(error, CredentialsError):
                silent.add(at)  # other keys would not be answered either
    raise BusError(f"the router has not received it: {'; '.join(problems)}")


def _ways(
    endpoint: str, typed_keys: Path | None, order: Estop | EstopRelease, problems: list[str]
) -> list[tuple[str, Credentials | None]]:
    """The endpoints and keys with which to give an order. For an emergency stop that is all there is, the likeliest
    first, as what a person's variables and folders hold must not keep it from the robots.

    Args:
        problems: what is wrong with a folder of keys is appended to it.

    Raises:
        CredentialsError: as for `_link`.
    """
    if isinstance(order, EstopRelease):
        return [(endpoint, credentials_for(endpoint, typed_keys, OFFICIAL))]
    protocol, _, address = endpoint.partition("/")
    with_keys: list[tuple[str, Credentials | None]] = []
    for folder in folders_of_keys(endpoint, typed_keys):
        try:
            with_keys += [(f"tls/{address}", found) for found in credentials_of(folder, STOPPING)]
        except CredentialsError as error:
            problems.append(str(error))
    if protocol == "tls":
        return [*(with_keys or [(endpoint, None)]), (f"tcp/{address}", None)]
    return [(endpoint, None), *with_keys]
