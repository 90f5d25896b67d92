"""The list of the matches that run on this machine, so that `vrg official halt` needs no address."""

import json
import logging
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from vrg.errors import ConfigError
from vrg.registry import did_you_mean
from vrg.system import POSIX, lock

log = logging.getLogger(__name__)

LOOK: Final = 1.0
"""The real time in s between two looks at whether a match still runs."""
_PROBE = 2.0
"""s for a program to accept a connection."""


@dataclass(frozen=True)
class RunningMatch:
    """A match that a launcher on this machine has started.

    Args:
        match: its name. router: the endpoint of its router. run: its run folder. pid: the launcher's process id.
        folder: the working folder in which it was started.
        keys: the folder of the keys of its seats; empty in a match without them.
    """

    match: str
    router: str
    run: str
    pid: int
    folder: str = ""
    keys: str = ""

    @property
    def is_own(self) -> bool:
        """True if it was started in the present working folder, or in one above or below it."""
        here, there = Path.cwd(), Path(self.folder)
        return here == there or here in there.parents or there in here.parents


def _folder() -> Path:
    import platformdirs  # noqa: PLC0415 - a help page needs no list

    return platformdirs.user_state_path("vrg")


@contextmanager
def registered(match: RunningMatch) -> Iterator[None]:
    """List a match as long as the context lasts.

    The launcher locks the entry, so that an entry whose launcher was killed can be recognised. An entry is seen only
    when it is whole and locked. If the folder cannot be written, the match goes on without an entry, and commands must
    then name its address.
    """
    path = _folder() / f"{match.match}-{match.pid}.json"
    unfinished = path.with_suffix(".new") if POSIX else path  # Windows neither renames nor deletes what is open
    entry = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        entry = unfinished.open("w", encoding="utf-8")
        lock(entry, wait=True)
        json.dump(asdict(match), entry)
        entry.flush()
        if POSIX:
            unfinished.replace(path)
    except OSError as error:
        log.warning("commands will not find this match automatically: %s", error)
    try:
        yield
    finally:
        if entry is not None:
            entry.close()
            path.unlink(missing_ok=True)


def running() -> list[RunningMatch]:
    """The matches whose launcher is alive."""
    matches = []
    for path in sorted(_folder().glob("*.json")):
        try:
            with path.open(encoding="utf-8") as entry:
                if not (abandoned := lock(entry, shared=True)):
                    matches.append(RunningMatch(**json.load(entry)))
            if abandoned:
                path.unlink(missing_ok=True)
        except (OSError, ValueError, TypeError, RecursionError):
            continue
    return matches


def find(match: str | None, router: str | None, default_router: str) -> tuple[str, str]:
    """The (match, router endpoint) that a command means.

    Args:
        match, router: what was typed; None if nothing was.
        default_router: the endpoint to use for a match that is named but does not run on this machine.

    Raises:
        ConfigError: several running matches fit, or none does.
    """
    if match and router:
        return match, router
    everywhere = running()
    found = [m for m in everywhere if match in (None, m.match) and router in (None, m.router)]
    if len(found) == 1:
        return found[0].match, found[0].router
    if len(found) > 1:
        listed = "\n".join(f"  {m.match} --router {m.router}   ({m.run})" for m in found)
        raise ConfigError(f"several matches run on this machine; say which:\n{listed}")
    if match is None:
        raise ConfigError("no match runs on this machine; for one elsewhere, give its name and --router")
    of_others = {m.router.partition("/")[2] for m in everywhere}
    if router is None and (default_router.partition("/")[2] in of_others or not _answers(default_router)):
        names = [m.match for m in everywhere]
        raise ConfigError(
            f"expected a match that runs on this machine ({', '.join(names) or 'none'}), got {match!r}; name the "
            f"router of a match on another machine with --router{did_you_mean(match, names)}"
        )
    return match, router or default_router


def _answers(endpoint: str) -> bool:
    """True if some program accepts connections at an endpoint of TCP."""
    host, _, port = endpoint.partition("/")[2].rpartition(":")
    try:
        socket.create_connection((host, int(port)), timeout=_PROBE).close()
    except (OSError, ValueError):
        return False
    return True


def gone(match: str, endpoint: str) -> Callable[[], bool]:
    """Make a function that returns True once a match that runs on this machine has ended; it looks once a second.

    For a match that runs elsewhere, this is not known.
    """
    launchers = {found.pid for found in running() if (found.match, found.router) == (match, endpoint)}
    looked, ended = time.monotonic(), False

    def has_ended() -> bool:
        nonlocal looked, ended
        if launchers and time.monotonic() - looked >= LOOK:
            looked = time.monotonic()
            ended = not any(found.pid in launchers for found in running())
        return ended

    return has_ended
