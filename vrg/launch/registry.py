"""Which matches run on this machine, so that `vrg official halt` needs no address."""

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import platformdirs

from vrg.errors import ConfigError
from vrg.launch.run_folder import write_json


@dataclass(frozen=True)
class RunningMatch:
    """A match that a launcher on this machine has started.

    Args:
        match: its name. router: the endpoint of its router. run: its run folder. pid: of the launcher.
    """

    match: str
    router: str
    run: str
    pid: int


def _folder() -> Path:
    return platformdirs.user_state_path("vrg", ensure_exists=True)


def register(match: RunningMatch) -> Path:
    """Tell others of a match; delete the file when it ends."""
    path = _folder() / f"{match.match}-{match.pid}.json"
    write_json(path, asdict(match))
    return path


def running() -> list[RunningMatch]:
    """The matches whose launcher is alive."""
    matches = []
    for path in sorted(_folder().glob("*.json")):
        try:
            match = RunningMatch(**json.loads(path.read_text()))
            os.kill(match.pid, 0)
        except (OSError, ValueError, TypeError):
            continue
        matches.append(match)
    return matches


def find(match: str | None, router: str | None, default_router: str) -> tuple[str, str]:
    """The (match, router endpoint) that a command means.

    Args:
        match, router: as typed, None = not.

    Raises:
        ConfigError: several matches run and none is named, or none runs and no name is given.
    """
    if match and router:
        return match, router
    found = [m for m in running() if match in (None, m.match) and router in (None, m.router)]
    if len(found) == 1:
        return found[0].match, found[0].router
    if len(found) > 1:
        listed = "\n".join(f"  --match {m.match} --router {m.router}   ({m.run})" for m in found)
        raise ConfigError([f"several matches run on this machine; say which:\n{listed}"])
    if match is None:
        raise ConfigError(["no match runs on this machine; name one with --match (and --router)"])
    return match, router or default_router
