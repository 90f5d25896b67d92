"""The files and ports that the process of one player of a match needs, which is all that it may reach."""

import os
import sys
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import vrg
from vrg.bus.hosts import port_of
from vrg.config.setup import MatchSetup, PlayerSetup
from vrg.errors import SandboxError
from vrg.launch.code_files import imported, readable_parts
from vrg.launch.sandbox.policy import Access, Policy, files
from vrg.registry import plugin_packages
from vrg.runs.run_folder import RunFolder


def policy_of(setup: MatchSetup, name: str, *, router: str | None, run: RunFolder, seat: Path | None) -> Policy:
    """The policy of a player's process.

    Args:
        name: the player. run: the run folder.
        router: the endpoint of the router; None in a match in one process, which waits for each player in turn, so
            that a processor core of its own would only slow it.
        seat: the folder of the keys of its own seat; None in a match without seats.

    Raises:
        ConfigError: there is no such player. SandboxError: `router` has no TCP port.
    """
    player = setup.player(name)
    ports = _ports_of_robot(setup, player)  # this imports the package of the robot's driver
    base = Path(setup.base).resolve()
    code = setup.strategy_file(name)
    theirs = _of_others(setup, player)
    # Where it runs on another machine, its code lies among the files of the run.
    secret = theirs | {path for path in vars(run).values() if path != run.path}
    needed = [code, *imported(code, theirs)] if code is not None else []
    own = [part for path in needed for part in readable_parts(path) if part not in secret]
    folder = run.of_player(name).resolve()
    # Its statistics are written to a file that is there already, so that it can make no others beside it.
    statistics = run.logs.resolve() / f"{name}.json"
    keys = base / "keys" if seat is None else seat.parent
    # The runs beside this one have the code of all players, too.
    hidden = theirs | {run.path, run.path.parent, keys, base / "keys", Path(setup.origin)}
    allowed = files(
        own=own,
        libraries=libraries(),
        hidden={path.resolve() for path in hidden},
        folder=folder,
        written=[statistics],
        entries=entries_of,
    )
    # Named files are readable wherever they lie: its keys, and what its robot's driver reads.
    named = [] if seat is None else [seat]
    can = setup.backends.get(player.backend, {}) if player.physical or player.backend != "sim" else {}
    buses = [can, can.get("robots", {}).get(name, {})] if can else []
    named += [base / str(bus["calibration"]) for bus in buses if bus.get("calibration")]
    channels = [Path(str(bus["channel"])) for bus in buses if str(bus.get("channel", "")).startswith("/dev/")]
    interfaces = {str(bus["interface"]) for bus in buses if bus.get("interface")}
    return Policy(
        files=(
            *allowed,
            *((path, Access.READ) for path in named),
            *((path, Access.READ | Access.WRITE | Access.DEVICE) for path in channels),
        ),
        ports=(*(() if router is None else (_port(router),)), *ports),
        folder=folder,
        memory=setup.memory,
        core=None if player.physical or router is None else player.number,
        udp="udp_multicast" in interfaces,
        can="socketcan" in interfaces,
    )


def _ports_of_robot(setup: MatchSetup, player: PlayerSetup) -> list[int]:
    """The TCP ports that the driver of a player's robot connects to."""
    for backend, settings, robots in setup.backend_settings():
        if backend == player.backend and player.name in robots:
            return [_port(endpoint) for endpoint in settings.endpoints([player.name])]
    return []


def _of_others(setup: MatchSetup, player: PlayerSetup) -> set[Path]:
    """The strategies of other teams, and what only they import: to import it oneself is not enough to read it.

    A module that both import is taken to be shared.
    """
    teams: dict[Path, set[str]] = {}
    for other in setup.players:
        if (code := setup.strategy_file(other.name)) is not None:
            teams.setdefault(code, set()).add(other.team)
    own = {code for code, players in teams.items() if player.team in players}
    foreign = set(teams) - own

    def parts_of(code: Path) -> set[Path]:
        needed = imported(code, foreign if code in own else own)
        return {part for path in (code, *needed) for part in readable_parts(path)}

    parts = {code: parts_of(code) for code in teams}
    ours = {part for code in own for part in parts[code]}
    others = {part for code in foreign for part in readable_parts(code)}
    theirs = ({part for found in parts.values() for part in found} - ours) | others | foreign
    return theirs | {path.parent / "__pycache__" for path in theirs}


def libraries() -> list[Path]:
    """The folders of Python, of VRG and of the packages that can be imported, those that add to VRG among them."""
    prefixes = {sys.prefix, sys.base_prefix, sys.exec_prefix, sys.base_exec_prefix}
    found = {Path(prefix).resolve() for prefix in prefixes} | {Path(vrg.__file__).resolve().parent}
    found |= {Path(entry).resolve() for entry in sys.path if entry}
    return sorted(found | _plugins())


@cache
def _plugins() -> frozenset[Path]:
    """The packages that add to VRG by entry points: after `pip install -e` they lie in no folder of `sys.path`."""
    specs = [find_spec(module) for module in plugin_packages()]
    places = [
        place for spec in specs if spec for place in (*(spec.submodule_search_locations or ()),) or (spec.origin,)
    ]
    return frozenset(Path(place).resolve() for place in places if place)


def entries_of(folder: Path) -> Iterator[Path]:
    """The files and folders in a folder; none if it cannot be listed."""
    try:
        yield from (Path(entry.path) for entry in os.scandir(folder))
    except OSError:
        return


def _port(router: str) -> int:
    port = port_of(router)
    if not port.isdecimal():
        raise SandboxError(f"expected a router with a TCP port, such as tcp/127.0.0.1:7447, got {router!r}")
    return int(port)
