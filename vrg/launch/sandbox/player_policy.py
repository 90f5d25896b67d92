"""The files that the strategy of one player of a match needs, which is all that its process may reach."""

import os
import sys
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import vrg
from vrg.config.code_files import imported, readable_parts
from vrg.config.setup import MatchSetup, PlayerSetup
from vrg.games import file_of
from vrg.launch.sandbox.policy import SealPolicy, files
from vrg.registry import plugin_packages
from vrg.runs.run_folder import RunFolder


def policy_of(
    setup: MatchSetup, name: str, *, run: RunFolder, keys: Path | None = None, pinned: bool = False
) -> SealPolicy:
    """The policy of the process in which a player's strategy decides.

    Args:
        name: the player. run: the run folder. keys: the folder of the keys of the match's seats, if there is one.
        pinned: True gives it one processor core, on which it comes behind others. In a match that waits for each
            player in turn this would only slow it.

    Raises:
        ConfigError: there is no such player.
    """
    player = setup.player(name)
    base = Path(setup.base).resolve()
    code = setup.strategy_file(name)
    theirs = _of_others(setup, player)
    # Where it runs on another machine, its code lies among the files of the run.
    secret = theirs | {path for path in vars(run).values() if path != run.path}
    needed = [code, *imported(code, theirs)] if code is not None else []
    own = [part for path in needed for part in readable_parts(path) if part not in secret]
    # Python looks for modules in a list of a folder's files.
    listed = [part.parent for part in own] if len(own) > 1 else []
    listed += [code.parent] if code is not None and file_of(player.strategy) is None else []
    folder = run.of_player(name).resolve()
    # The runs beside this one have the code of all players, too.
    hidden = theirs | {run.path, run.path.parent, base / "keys", keys or base / "keys", Path(setup.origin)}
    allowed = files(
        own=own,
        listed=listed,
        libraries=libraries(),
        hidden={path.resolve() for path in hidden},
        folder=folder,
        entries=entries_of,
    )
    return SealPolicy(files=allowed, folder=folder, memory=setup.memory, core=player.number if pinned else None)


def _of_others(setup: MatchSetup, player: PlayerSetup) -> set[Path]:
    """The strategies of other teams, and what only they import: to import it oneself is not enough to read it.

    A module that both import is taken to be shared.
    """
    teams: dict[Path, set[str]] = {}
    for other in setup.players:
        code = setup.strategy_file(other.name)
        if code is not None and code not in _plugins():
            teams.setdefault(code, set()).add(other.team)
    own = {code for code, players in teams.items() if player.team in players}
    foreign = set(teams) - own

    def parts_of(code: Path) -> set[Path]:
        needed = imported(code, foreign if code in own else own)
        return {part for path in (code, *needed) for part in readable_parts(path)}

    parts = {code: parts_of(code) for code in teams}
    ours = {part for code in own for part in parts[code]}
    others = {part for code in foreign for part in readable_parts(code)}
    imports = {part for found in parts.values() for part in found} - ours
    # A package that adds to VRG, such as the game, is a library also where it lies beside the match.
    imports = {part for part in imports if not any(part.is_relative_to(place) for place in _plugins())}
    theirs = imports | others | foreign
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
