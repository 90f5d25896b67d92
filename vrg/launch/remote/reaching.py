"""Reaches the machines of a match, and decides where its router is."""

import secrets
from collections.abc import Callable, Mapping
from pathlib import Path

from vrg.bus.credentials import find_credentials
from vrg.bus.seats import Seat, SeatKind
from vrg.bus.stopping import StopSignal
from vrg.config.files import HERE, Machine
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.launch.endpoints import free_endpoint
from vrg.launch.events import NoNotes, Notes
from vrg.launch.remote.conversation import Conversation, Visit
from vrg.launch.remote.remote_host import RemoteHost
from vrg.launch.run_folder import RunFolder
from vrg.launch.specs import seats_at

_WAIT = 0.02
"""The real time in s between two looks at what the machines say."""


def remote_hosts(
    setup: MatchSetup,
    folder: RunFolder,
    *,
    window: bool,
    record: bool,
    announce: Callable[[str], None],
    notes: Notes | None = None,
) -> dict[str, RemoteHost]:
    """The machines of a match besides the launcher's, by their names in the match file. None is reached yet.

    Args:
        folder: the run folder, with all files that the match needs.
        window: True opens the spectator somewhere. record: True runs the recorder somewhere.
        announce: called with a text about each event that a person should know of.
        notes: told what happens to their processes.
    """
    # Two launchers may have begun in the same second, and may use the same machine.
    run = f"{folder.path.name}-{secrets.token_hex(3)}"
    told = notes or NoNotes()

    def host(name: str, machine: Machine) -> RemoteHost:
        # Two machines may share a home folder.
        visit = Visit(run=f"{run}-{name}", window=window, record=record, secret=setup.secret)
        return RemoteHost(name, Conversation(name, machine, folder, visit, announce, told), announce)

    return {name: host(name, machine) for name, machine in setup.hosts.items()}


def router_endpoints(setup: MatchSetup, hosts: Mapping[str, RemoteHost], *, secure: bool = False) -> dict[str, str]:
    """The endpoints for the routers of a match, by their machines; each machine is told which to use.

    Args:
        hosts: the other machines, which have read the match. secure: True for a match with seats.

    Raises:
        LaunchError: there is none that all machines can reach.
    """
    main = setup.place.get("router", HERE)
    if main in hosts:
        endpoint = _secured(hosts[main].talk.endpoint, secure)
        if not endpoint:
            raise LaunchError(f"{main}: expected an address for the router: write `address = ...` into its table")
    else:
        own = setup.machines.get(HERE)
        seen = next((host.talk.peer for host in hosts.values() if host.talk.peer), None)
        address = own.address if own is not None and own.address else seen
        if hosts and address is None:
            raise LaunchError(
                "the other machines do not tell at which address they see this one: write `address = ...` into "
                "[machines.here]"
            )
        try:
            endpoint = free_endpoint(address, secure=secure)
        except OSError as error:
            raise LaunchError(
                f"no router can serve at {address}: {error}: write this machine's address into [machines.here]"
            ) from error
    endpoints = {main: endpoint}
    for name, machine in setup.machines.items():
        if machine.router and name in hosts:
            if not hosts[name].talk.endpoint:
                raise LaunchError(f"{name}: expected an address for its router: write `address = ...` into its table")
            endpoints[name] = _secured(hosts[name].talk.endpoint, secure)
    for name, host in hosts.items():
        used = setup.router_at(name)
        host.use_router(endpoints.get(used, endpoint), endpoint if used == name != main else None)
    return endpoints


def _secured(endpoint: str, secure: bool) -> str:
    """An endpoint that an agent offers, for a match with seats or without."""
    return endpoint.replace("tcp/", "tls/", 1) if secure else endpoint


def hand_out_keys(
    setup: MatchSetup, hosts: Mapping[str, RemoteHost], keys: Path, *, window: bool, record: bool
) -> None:
    """Let each machine have the keys of its own seats, and no others.

    Args:
        keys: the folder of the keys of all seats.
        window: True opens the spectator somewhere. record: True runs the recorder somewhere.

    Raises:
        CredentialsError: a seat has no keys.
    """
    for name, host in hosts.items():
        seats = [Seat(SeatKind.HOST, name), *seats_at(setup, name, window=window, record=record)]
        host.use_keys([find_credentials(keys, [seat]) for seat in seats])


def reach(
    hosts: Mapping[str, RemoteHost], stop: StopSignal, progress: Callable[[str], None]
) -> dict[str, LaunchError] | None:
    """Reach all machines at once, and let each read the match.

    Args:
        progress: called with the name of each machine that can play.

    Returns:
        why machines cannot be used, by name; None if `stop` was set before all have answered.
    """
    for host in hosts.values():
        host.connect()
    problems: dict[str, LaunchError] = {}

    def loaded(name: str) -> bool:
        if not hosts[name].loaded():
            return False
        progress(name)
        return True

    return problems if wait_for(hosts, loaded, problems, stop) else None


def wait_for(
    hosts: Mapping[str, RemoteHost],
    condition: Callable[[str], bool],
    problems: dict[str, LaunchError],
    stop: StopSignal,
) -> bool:
    """Wait until a condition holds for each machine, or raises LaunchError, which is put into `problems`.

    Args:
        condition: looks once, given the name of a machine.

    Returns:
        False if `stop` was set before.
    """
    waiting = [name for name in hosts if name not in problems]
    while waiting:
        for name in list(waiting):
            try:
                if condition(name):
                    waiting.remove(name)
            except LaunchError as error:
                waiting.remove(name)
                problems[name] = error
        for host in hosts.values():
            host.keep()
        if stop.wait(_WAIT):
            return False
    return True
