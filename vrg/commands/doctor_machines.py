"""The checks of `vrg doctor match.toml`: it reaches each machine of a match and checks it before anything starts."""

import contextlib
import tempfile
from datetime import datetime
from pathlib import Path

import typer
from rich.console import Console

from vrg.bus.session import open_router, open_session
from vrg.bus.stopping import Stop
from vrg.commands.options import stoppable
from vrg.config.files import HERE
from vrg.config.loading import idle_machines, load_match
from vrg.config.setup import MatchSetup
from vrg.errors import BusError, LaunchError
from vrg.launch.findings import examine
from vrg.launch.remote.reaching import remote_hosts, router_endpoints, wait_for
from vrg.launch.remote.remote_host import RemoteHost, StartupStep
from vrg.plugins import Finding
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder

_TRIPS = 3
"""The number of words there and back, two in a second, of which the quickest is reported."""
_ODD = 2.0
"""A wall clock that is further off than this, s, is reported."""


def examine_machines(match_file: Path) -> dict[str, list[Finding]]:
    """Check every machine of a match, and return what was found by the machine's name.

    Raises:
        ConfigError: the match file has problems.
        typer.Exit: Ctrl-C was pressed.
    """
    setup = load_match(match_file)
    console = Console(stderr=True, highlight=False, emoji=False)
    with tempfile.TemporaryDirectory(prefix="vrg-doctor-") as name, stoppable() as stop:
        folder = RunFolder.create(Path(name), setup.name, datetime.now())
        keep(setup, folder)
        remote = remote_hosts(setup, folder, window=True, record=True, announce=console.print, examine=True)
        with console.status(f"checking {', '.join([HERE, *remote])}"), contextlib.ExitStack() as stack:
            for host in remote.values():
                stack.callback(host.close)
            # An agent wants to hear of its launcher all the time, so this machine comes first.
            here = examine(setup, folder.match_file, HERE)
            found = _examined(setup, remote, stop)
            idle = [Finding("place", None, text)] if (text := idle_machines(setup)) else []
            return {HERE: [*here, *idle, *found.pop(HERE, [])], **found}


def _examined(setup: MatchSetup, remote: dict[str, RemoteHost], stop: Stop) -> dict[str, list[Finding]]:
    problems = wait_for(remote, lambda host: host.is_at(StartupStep.LOADED), stop)
    if problems is None:
        raise typer.Exit(130)
    findings = {name: [Finding("ssh", False, str(error))] for name, error in problems.items()}
    reached = {name: host for name, host in remote.items() if name not in problems}
    for name, host in reached.items():
        findings[name] = [Finding("ssh", True, f"{setup.hosts[name].host} answers"), *host.reports.findings]
    for name, finding in _connected(setup, remote, reached, stop).items():
        findings.setdefault(name, []).append(finding)
    for name, host in reached.items():
        findings[name] += _clock(host)
    return findings


def _connected(
    setup: MatchSetup, remote: dict[str, RemoteHost], reached: dict[str, RemoteHost], stop: Stop
) -> dict[str, Finding]:
    """Start the router for a moment, and let every machine connect to it."""
    placed = setup.place.get("router", HERE)
    if placed != HERE and placed not in reached:
        return {name: Finding("router", False, f"its machine, {placed}, cannot be used") for name in reached}
    found: dict[str, Finding] = {}
    with contextlib.ExitStack() as stack:
        try:
            endpoint = router_endpoints(setup, reached)[placed]
            if placed == HERE:
                stack.enter_context(open_router(endpoint))
            else:
                reached[placed].start_router(stop)
            with open_session(endpoint):
                found[HERE] = Finding("router", True, f"answers at {endpoint}")
        except (LaunchError, BusError) as error:
            return {placed: Finding("router", False, str(error))}
        for host in reached.values():
            host.aim(StartupStep.JOINED)
        failed = wait_for(
            reached, lambda host: host.is_at(StartupStep.JOINED) and len(host.reports.trips) >= _TRIPS, stop
        )
        if failed is None:
            raise typer.Exit(130)
        for name in reached:
            if name in failed:
                advice = "is its port open in the firewall, and is the address right?"
                found[name] = Finding("router", False, f"{failed[name]}: {advice}")
            else:
                found[name] = Finding("router", True, f"reached at {endpoint}")
    return found


def _clock(host: RemoteHost) -> list[Finding]:
    """The round trip of a message, and the offset of the machine's wall clock."""
    if not host.reports.trips:
        return []
    quickest = min(host.reports.trips)
    offset = quickest.wall_offset
    found = [Finding("link", None, f"a round trip took {1000 * quickest.took:.0f} ms over ssh")]
    if abs(offset) > _ODD:
        way = "ahead of" if offset > 0 else "behind"
        text = f"is {abs(offset):.0f} s {way} this machine's: matches are not affected, but the times in logs differ"
        found.append(Finding("wall clock", None, text))
    return found
