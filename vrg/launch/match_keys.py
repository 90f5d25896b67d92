"""The keys with which a launcher plays a match: those that were made before, or some for this run alone."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path

from vrg.errors import ConfigError
from vrg.launch.folder_lock import delete_abandoned_keys, keys_lock
from vrg.seats.authority import authority_name
from vrg.seats.folder import LOCAL_HOSTS, KeysFolder
from vrg.seats.seat import Roster, Seat

_PREFIX = "vrg-keys-"
_LASTS = timedelta(days=2)
"""The time for which keys are valid that are made for one run. They are deleted with its end."""


@contextmanager
def keys_for(roster: Roster, given: Path | None, now: datetime, addresses: Sequence[str] = ()) -> Iterator[Path]:
    """The folder of the keys of all seats of a match.

    Args:
        given: a folder that `vrg keys init` has made. Without it, an authority is made for this run alone: its own key
            is never written, and the others are in a private folder that is deleted at the end of the context. If the
            launcher is killed, its processes delete it when they end, or else the next launcher does.
        now: the present instant, with its time zone. addresses: of the machines of the routers.

    Raises:
        ConfigError: the given folder lacks a seat of the match, or a certificate in it has expired, or is of another
            authority or of another match.
    """
    if given is not None:
        check_keys(KeysFolder(given), roster.match, roster.seats, now)
        yield given
        return
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    parent = Path(runtime if runtime and os.access(runtime, os.W_OK) else tempfile.gettempdir())
    delete_abandoned_keys(parent.glob(f"{_PREFIX}*"))
    with tempfile.TemporaryDirectory(prefix=_PREFIX, dir=parent) as made, keys_lock(Path(made)):
        hosts = list(dict.fromkeys([*LOCAL_HOSTS, *addresses]))
        KeysFolder(Path(made)).make(roster.match, roster.seats, now, lasts=_LASTS, hosts=hosts, keep_authority=False)
        yield Path(made)


def check_keys(folder: KeysFolder, match: str, seats: Sequence[Seat], now: datetime) -> None:
    """Make sure that a folder has good keys for some seats of a match.

    Raises:
        ConfigError: a seat lacks keys, or its certificate has expired, or is of another authority than the others or
            of another match.
    """
    found = {entry.credentials.common_name: entry for entry in folder.entries()}
    problems = []
    for seat in seats:
        entry = found.get(seat.common_name)
        if entry is None:
            problems.append(f"the seat {seat} has no keys: run `vrg keys renew MATCH`")
        elif not entry.genuine or entry.validity.common_name != seat.common_name:
            problems.append(
                f"the certificate of the seat {seat} is not one of this authority: run `vrg keys renew MATCH`"
            )
        elif entry.validity.authority != authority_name(match):
            problems.append(
                f"expected keys of the match {match} ({authority_name(match)}), found some of "
                f"{entry.validity.authority} for the seat {seat}: name the folder of this match's keys"
            )
        elif entry.validity.is_over(now):
            problems.append(
                f"the certificate of the seat {seat} has expired on {entry.validity.ends:%Y-%m-%d %H:%M} UTC: run "
                "`vrg keys renew MATCH`"
            )
    if problems:
        raise ConfigError([f"{folder.path}: {problem}" for problem in problems])
