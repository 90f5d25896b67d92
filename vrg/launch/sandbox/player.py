"""What the process of one player of a match needs, which is all that it is left."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import vrg
from vrg.bus.hosts import port_of
from vrg.config.setup import MatchSetup, PlayerSetup
from vrg.errors import SandboxError
from vrg.launch.code_files import imported
from vrg.launch.remote.folder_lock import NAME as LOCK
from vrg.launch.run_folder import RunFolder
from vrg.launch.sandbox.policy import Access, Policy, files
from vrg.modules import module_in


def policy_of(setup: MatchSetup, name: str, *, router: str | None, run: RunFolder, seat: Path | None) -> Policy:
    """What a player's process may reach.

    Args:
        name: the player. run: the run folder.
        router: the endpoint of the router; None in a match in one process, which waits for each player in turn, so
            that a processor core of its own would only slow it.
        seat: the folder of the keys of its own seat; None in a match without seats.

    Raises:
        ConfigError: there is no such player. SandboxError: `router` has no TCP port.
    """
    player = setup.player(name)
    base = Path(setup.base).resolve()
    code = strategy_file(player, base)
    home = code.parent if code is not None else base
    folder = run.of_player(name).resolve()
    # Its statistics are written to a file that is there already, so that it can make no others beside it.
    statistics = run.logs.resolve() / f"{name}.json"
    own = [home, *(imported(code) if code is not None else [])]
    allowed = files(
        own=own,
        libraries=libraries(),
        hidden=_hidden(setup, player, run.path.resolve(), home, keys=base / "keys" if seat is None else seat.parent),
        folder=folder,
        written=[statistics],
        entries=entries_of,
    )
    # Named files are readable wherever they lie: its strategy's, its keys, and what its robot's driver reads.
    named = [path for path in (code, seat) if path is not None]
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
        port=None if router is None else _port(router),
        folder=folder,
        memory=setup.memory,
        core=None if player.physical or router is None else player.number,
        udp="udp_multicast" in interfaces,
        can="socketcan" in interfaces,
    )


def strategy_file(player: PlayerSetup, base: Path) -> Path | None:
    """The file or the package of a player's strategy; None if it is none of the match's own.

    Args:
        base: the folder that relative paths in the match file start from.
    """
    path = player.strategy.rpartition(":")[0]
    if path.endswith(".py"):
        return (base / path).resolve()
    found = module_in(base, path.split(".")[0]) if path else None
    return None if found is None else found.resolve()


def _hidden(setup: MatchSetup, player: PlayerSetup, run: Path, home: Path, *, keys: Path) -> set[Path]:
    """What a player may not read in the folder of its strategy.

    That is the strategies of other teams, what only they import, the runs of matches, and the keys of all seats,
    although its own are allowed besides. A module that both import is taken to be shared.
    """
    base = Path(setup.base).resolve()
    teams: dict[Path, set[str]] = {}
    for other in setup.players:
        if (code := strategy_file(other, base)) is not None:
            teams.setdefault(code, set()).add(other.team)
    parts = {code: {code, *imported(code)} for code in teams}
    own = {code for code, players in teams.items() if player.team in players}
    ours = {part for code in own for part in parts[code]}
    # To import a strategy of others is not enough to read it.
    theirs = ({part for found in parts.values() for part in found} - ours) | (set(teams) - own)
    kept = RunFolder(run)
    files_of_run = {
        kept.logs,
        kept.journal,
        kept.events,
        kept.setup,
        kept.setups,
        kept.secret_file,
        kept.snapshot,
        kept.of_player("").resolve(),
        run / "files",
        run / "substitutes",
        run / LOCK,
    }
    # The match file has the settings of other teams, too.
    files_of_run |= {Path(setup.origin)}
    files_of_run |= {kept.match_file, kept.result, *kept.recordings()}
    # The runs beside this one have the code of all players, too.
    hidden = theirs | files_of_run | {run, run.parent, keys, base / "keys"}
    caches = {path.parent / "__pycache__" for path in theirs}
    resolved = {path.resolve() for path in hidden | caches}
    return {path for path in resolved if not home.is_relative_to(path)}


def libraries() -> list[Path]:
    """The folders of Python, of VRG and of the packages that can be imported."""
    prefixes = {sys.prefix, sys.base_prefix, sys.exec_prefix, sys.base_exec_prefix}
    found = {Path(prefix).resolve() for prefix in prefixes} | {Path(vrg.__file__).resolve().parent}
    found |= {Path(entry).resolve() for entry in sys.path if entry}
    return sorted(found)


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
