"""Finds the running match, or the recorded run, that a command means, and opens sessions with it."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from vrg.bus.session import DEFAULT_ENDPOINT, Session, open_session
from vrg.bus.stopping import Stop
from vrg.bus.topics import Keys
from vrg.commands.groups import MatchOptions
from vrg.commands.options import KEYS_VARIABLE, exit_if_interrupted, stoppable
from vrg.errors import ConfigError, LaunchError
from vrg.kinds import Kind
from vrg.launch import running
from vrg.registry import did_you_mean
from vrg.seats.credentials import Credentials, find_credentials
from vrg.seats.seat import Seat

if TYPE_CHECKING:
    from vrg.config.setup import MatchSetup
    from vrg.runs.run_folder import RunFolder


@dataclass(frozen=True)
class Attached:
    """A running match.

    Args:
        name: its name. endpoint: of its router. typed_keys: the folder of keys that was typed, if one was.
        setup: its set-up; where that is not known on this machine, one without robots and obstacles.
        run: its run folder; None if that is not on this machine.
    """

    name: str
    endpoint: str
    typed_keys: Path | None
    setup: "MatchSetup"
    run: Path | None = None

    @property
    def keys(self) -> Keys:
        """Its keys on the bus."""
        return Keys(self.name)

    def known_setup(self) -> "MatchSetup":
        """Its set-up.

        Raises:
            ConfigError: it is not known on this machine.
        """
        if not self.setup.players:
            raise ConfigError(f"{self.name} runs on another machine: type its match file in place of its name")
        return self.setup

    def serve(self, kind: Kind, name: str = "", run: Path | None = None, secret: str = "") -> None:
        """Run a node of it in this process until it ends; see `vrg.launch.process_main.serve`."""
        from vrg.launch.process import by_hand  # a decision needs no node
        from vrg.launch.process_main import serve

        process = by_hand(kind, name, self.endpoint, run=run, keys=keys_of(self.endpoint, self.typed_keys))
        exit_if_interrupted(serve(process, self.setup, secret=secret, quiet=True))


def which_match(on: MatchOptions) -> tuple[str, str]:
    """The (name, endpoint) of the running match that is meant.

    Raises:
        ConfigError: it is not clear which match is meant.
    """
    name, router, _ = _named(on)
    return running.find(name, router, DEFAULT_ENDPOINT)


def attached(on: MatchOptions) -> Attached:
    """The running match that is meant. One that runs on this machine has left its set-up in its run folder.

    Raises:
        ConfigError: it is not clear which match is meant.
    """
    from vrg.config.setup import read_setup, unknown_match  # a decision needs no set-up
    from vrg.runs.run_folder import RunFolder

    name, router, setup = _named(on)
    found, endpoint = running.find(name, router, DEFAULT_ENDPOINT)
    here = next((m for m in running.running() if (m.match, m.router) == (found, endpoint)), None)
    if here is not None:
        run = RunFolder(Path(here.run))
        with suppress(LaunchError):
            return Attached(found, endpoint, on.keys, setup or read_setup(run.setup), run.path)
    return Attached(found, endpoint, on.keys, setup or unknown_match(found))


def _named(on: MatchOptions) -> "tuple[str | None, str | None, MatchSetup | None]":
    """The name of the match that was typed, the endpoint of its router, and its set-up if a match file was typed.

    Raises:
        ConfigError: there is no such match file, or the match of the run folder does not run.
    """
    typed, router, here = on.match, on.router, running.running()
    if typed is None or any(match.match == typed for match in here):
        return typed, router, None
    if Path(typed, "setup.json").is_file():
        run = str(Path(typed).resolve())
        match = next((match for match in here if match.run == run), None)
        if match is None:
            raise ConfigError(f"{typed}: the match of this run has ended: look at it with `vrg run`")
        return match.match, router or match.router, None
    setup = setup_named(typed)
    return typed if setup is None else setup.name, router, setup


def setup_named(typed: str) -> "MatchSetup | None":
    """The set-up of a match file, or of the match that a game ships with; None for another name.

    Raises:
        ConfigError: there is no such file, or it has problems.
    """
    from vrg.games import GAMES  # a match that runs here needs none

    if typed.endswith(".toml") or any(typed == game or typed.startswith(f"{game}-") for game in GAMES.names()):
        from vrg.config.loading import load_match, match_path

        try:
            path = match_path(typed)
        except ConfigError:
            if typed.endswith(".toml"):
                raise
            return None  # a name that only begins like a game's
        return load_match(path)
    return None


def own_match(on: MatchOptions, what: str) -> tuple[str, str]:
    """The (name, endpoint) of the running match that a command means which changes it.

    If it is not named, and was started in another folder, the person is asked: it may be another person's.

    Args:
        what: is to be done, in words.

    Raises:
        ConfigError: it is not clear which match is meant, or there is no terminal to ask at.
        typer.Exit: the person does not want it.
    """
    name, endpoint = which_match(on)
    found = next((m for m in running.running() if (m.match, m.router) == (name, endpoint)), None)
    if on.match is None and on.router is None and found is not None and not found.is_own:
        there = f"the only match that runs here is {name}, started in {found.folder}"
        if not sys.stdin.isatty():
            raise ConfigError(f"{there}: if you mean it, add its name, {name}")
        if not typer.confirm(f"{there}: {what}?"):
            raise typer.Exit(1)
    return name, endpoint


def keys_of(endpoint: str, typed: Path | None) -> Path | None:
    """The folder of the keys of a running match; None where its router wants none, or the folder is not known.

    Args:
        typed: what was typed with --keys.
    """
    if typed is not None or not endpoint.startswith("tls/"):
        return typed  # an endpoint that has no use for them refuses them
    return next(iter(folders_of_keys(endpoint, None)), None)


def folders_of_keys(endpoint: str, typed: Path | None) -> list[Path]:
    """The folders that may hold the keys of a running match, the likeliest first.

    These are what was typed, what the match has recorded, if it runs on this machine, and what VRG_KEYS names, which
    may be meant for another match.
    """
    recorded = [match.keys for match in running.running() if match.router == endpoint]
    return [Path(folder) for folder in (typed, *recorded, os.environ.get(KEYS_VARIABLE)) if folder]


def credentials_for(endpoint: str, typed: Path | None, *seats: Seat) -> Credentials | None:
    """The keys with which a command on a running match opens a session; None where the router wants none.

    Args:
        typed: as for `keys_of`. seats: the seats that will do, the preferred one first.

    Raises:
        CredentialsError: there are no keys of such a seat.
    """
    keys = keys_of(endpoint, typed)
    return None if keys is None else find_credentials(keys, seats)


@contextmanager
def connected(
    endpoint: str, typed_keys: Path | None, *seats: Seat, patience: float = 3.0
) -> Iterator[tuple[Stop, Session]]:
    """A session with the router of a running match, and a Stop that Ctrl-C sets.

    Args:
        typed_keys: the folder of keys that was typed, if one was. seats: as for `credentials_for`.
        patience: the real time in s to wait for the router.

    Raises:
        BusError: the router does not answer. CredentialsError: there are no keys of such a seat.
        typer.Exit: at the end, with status 130, if Ctrl-C was pressed.
    """
    credentials = credentials_for(endpoint, typed_keys, *seats)
    with stoppable() as stop, open_session(endpoint, patience=patience, stop=stop, credentials=credentials) as session:
        yield stop, session


def ended_run(run: Path | None, runs: Path = Path("runs")) -> "tuple[RunFolder, MatchSetup]":
    """A run folder whose match does not run any more, and the set-up of the match.

    Args:
        run: the folder, or its name in `runs`; None for the newest whose match has ended.

    Raises:
        LaunchError: it is no run folder, or its match runs.
    """
    folder, setup = run_of(run, runs, ended=True)
    if is_running(folder.path):
        raise LaunchError(f"{folder.path}: this match is still running: close its window, or try again when it ends")
    return folder, setup


def run_of(run: Path | None, runs: Path = Path("runs"), *, ended: bool = False) -> "tuple[RunFolder, MatchSetup]":
    """A run folder, and the set-up of its match, which may still run.

    Args:
        run: the folder, or its name in `runs`; None for the newest. ended: True passes by those that still run.

    Raises:
        LaunchError: it is no run folder.
    """
    from vrg.config.setup import read_setup
    from vrg.runs.run_folder import RunFolder

    whole = [path for path in run_folders(runs) if RunFolder(path).setup.is_file()]
    there = [path for path in whole if not (ended and run is None and is_running(path))]
    if run is None:
        if not whole:
            raise LaunchError(f"{runs}: expected a run folder in it, found none: `vrg play` makes one")
        run = (there or whole)[0]
        typer.echo(f"{run}:", err=True)
    elif not run.exists() and len(run.parts) == 1:
        run = runs / run
    folder = RunFolder(run)
    if not folder.setup.is_file():
        hint = did_you_mean(run.name, [path.name for path in there])
        raise LaunchError(f"{run}: expected a run folder with a {folder.setup.name}, found none{hint}")
    return folder, read_setup(folder.setup)


def need_recording(folder: "RunFolder") -> None:
    """Make sure that a run has a recording.

    Raises:
        LaunchError: it has none.
    """
    if not folder.recordings():
        raise LaunchError(f"{folder.path}: expected a recording (recording.mcap), found none: was --no-record given?")


def need_shown(folder: "RunFolder") -> None:
    """Make sure that a run has something by which it can be shown: a recording, or the evidence.

    Raises:
        LaunchError: it has neither.
    """
    if not folder.evidence.is_file():
        need_recording(folder)


def run_folders(runs: Path) -> list[Path]:
    """The folders in a folder that hold a match file or a set-up, the newest first."""
    found = []
    with suppress(OSError):
        for path in runs.iterdir():
            with suppress(OSError):
                if (path / "match.toml").is_file() or (path / "setup.json").is_file():
                    found.append((played_at(path), path))
    return [path for _, path in sorted(found, reverse=True)]


def played_at(run: Path) -> float:
    """The begin of a run folder's match, in s since 1970: a run writes the match file first.

    Raises:
        OSError: the folder is gone.
    """
    for first in (run / "match.toml", run / "setup.json"):
        with suppress(FileNotFoundError):
            return first.stat().st_mtime
    return run.stat().st_mtime


def is_running(run: Path) -> bool:
    """True if the match of a run folder runs on this machine."""
    return any(Path(match.run) == run.resolve() for match in running.running())
