"""Reaches the machines of a match, and decides where its router is."""

import secrets
from collections.abc import Callable, Mapping

from vrg.bus.session import DEFAULT_ENDPOINT
from vrg.bus.stopping import StopSignal
from vrg.config.files import HERE, Machine
from vrg.config.setup import MatchSetup
from vrg.errors import LaunchError
from vrg.launch.endpoints import free_endpoint
from vrg.launch.remote import wire
from vrg.launch.remote.remote_host import RemoteHost
from vrg.runs.events import NoNotes, Notes
from vrg.runs.run_folder import RunFolder

_WAIT = 0.02
"""The real time in s between two looks at what the machines send."""


def remote_hosts(
    setup: MatchSetup,
    folder: RunFolder,
    *,
    window: bool,
    record: bool,
    announce: Callable[[str], None],
    notes: Notes | None = None,
    examine: bool = False,
) -> dict[str, RemoteHost]:
    """The machines of a match besides the launcher's, by their names in the match file. None is reached yet.

    Args:
        folder: the run folder, with all files that the match needs.
        window: True opens the spectator somewhere. record: True runs the recorder somewhere.
        announce: called with a text about each event that a person should know of.
        notes: the log of events of their processes. examine: True lets each check whether the match can be played.
    """
    # Two launchers may have begun in the same second, and may use the same machine.
    run = f"{folder.path.name}-{secrets.token_hex(3)}"

    def prepare(name: str, machine: Machine) -> wire.Prepare:
        # Two machines may share a home folder.
        own = (f"{run}-{name}", name, machine.display, machine.address)
        return wire.Prepare(*own, window, record, setup.secret, {}, examine)

    return {
        name: RemoteHost(setup, folder, prepare(name, machine), announce, notes or NoNotes())
        for name, machine in setup.hosts.items()
    }


def router_endpoints(setup: MatchSetup, hosts: Mapping[str, RemoteHost], *, secure: bool = False) -> dict[str, str]:
    """The endpoints for the routers of a match, by their machines; each machine gets its own.

    Args:
        hosts: the other machines, which have read the match. secure: True for a match with seats.

    Raises:
        LaunchError: there is none that all machines can reach.
    """
    main = setup.place.get("router", HERE)
    if main in hosts:
        endpoint = _secured(hosts[main].reports.endpoint, secure)
        if not endpoint:
            raise LaunchError(f"{main}: expected an address for the router: write `address = ...` into its table")
    else:
        own = setup.machines.get(HERE)
        seen = next((host.reports.peer for host in hosts.values() if host.reports.peer), None)
        address = own.address if own is not None and own.address else seen
        if hosts and address is None:
            raise LaunchError(
                "the other machines do not say at which address they see this one: write `address = ...` into "
                "[machines.here]"
            )
        try:
            # A router of the robots' own may have the usual port of this machine, now or later.
            theirs = any(DEFAULT_ENDPOINT in table.endpoints(robots) for _, table, robots in setup.backend_settings())
            endpoint = free_endpoint(address, secure=secure, usual=not theirs)
        except OSError as error:
            raise LaunchError(
                f"no router can serve at {address}: {error}: write this machine's address into [machines.here]"
            ) from error
    endpoints = {main: endpoint}
    for name, machine in setup.machines.items():
        if machine.router and name in hosts:
            if not hosts[name].reports.endpoint:
                raise LaunchError("expected an address for its router: write `address = ...` into its table", name)
            endpoints[name] = _secured(hosts[name].reports.endpoint, secure)
    for name, host in hosts.items():
        used = setup.router_at(name)
        host.router = endpoints.get(used, endpoint)
        host.upstream = endpoint if used == name != main else None
    return endpoints


def _secured(endpoint: str, secure: bool) -> str:
    """An endpoint that an agent offers, for a match with seats or without."""
    return endpoint.replace("tcp/", "tls/", 1) if secure else endpoint


def wait_for(
    hosts: Mapping[str, RemoteHost],
    condition: Callable[[RemoteHost], bool],
    stop: StopSignal,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, LaunchError] | None:
    """Wait until a condition holds for each machine, or raises LaunchError.

    Args:
        condition: looks once at a machine. progress: called with the name of each for which it holds.

    Returns:
        why machines cannot be used, by name; None if `stop` was set before all have answered.
    """
    problems: dict[str, LaunchError] = {}
    waiting = dict(hosts)
    while waiting:
        for name, host in list(waiting.items()):
            try:
                if not condition(host):
                    continue
                progress(name)
            except LaunchError as error:
                problems[name] = error
            del waiting[name]
        for host in hosts.values():
            host.keep()
        if stop.wait(_WAIT):
            return None
    return problems
