"""Authors of a league that are programs: each finds a report of its games, and writes the next version of its entry.

An author is a command, such as one that asks a language model. It runs in a folder of its own, where it keeps what it
likes from turn to turn. There lie `report.json`, and its entry as `player.py`, which it changes. It can read no other
files but those of the system and what its table names, write none, and connect by TCP to the ports that this names.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Final

import msgspec
import psutil
from msgspec import Struct
from pydantic import Field, ValidationError

from vrg.errors import ConfigError
from vrg.files import read_text, toml_of, write_whole
from vrg.launch.sandbox.player_policy import entries_of, libraries
from vrg.launch.sandbox.policy import Access, SealPolicy, files
from vrg.runs.run_folder import delete
from vrg.tables import Table, problems_of
from vrg.toml_text import without
from vrg.types import printable
from vrg_league.entries import read_entry
from vrg_league.folder import write_record, writing
from vrg_league.games import OUTCOMES, GameRecord
from vrg_league.league import author_process
from vrg_league.league.folder import LeagueFolder
from vrg_league.league.league import League

GAMES: Final = 12
"""The number of the last games of an entry in its report."""
PLAYER: Final = "player.py"
"""The name of the file that an author writes, in its folder."""
_DNS_PORT: Final = 53
_CA_CERTIFICATES: Final = tuple(
    Path("/etc", name) for name in ("ssl/certs", "pki/tls/certs", "pki/tls/cert.pem", "pki/ca-trust/extracted")
)
_LOOK_INTERVAL: Final = 0.2
"""The time between two looks at a running author, s."""
_SAID: Final = 2000
"""The number of characters of what an author has printed that are kept."""


_Word = Annotated[str, Field(pattern=r"^[^\x00]+$")]


class Author(Table):
    """A program that writes an entry.

    Args:
        command: the program and its arguments; those that are files beside the table's file are found there.
        reads: further files and folders that it may read. ports: the TCP ports that it may connect to, such as 443.
        variables: the names of the environment variables that it gets, such as that of a key.
        seconds: the real time that it has for a version. memory: that it may use with all that it starts, MB.
    """

    command: tuple[_Word, ...] = Field(min_length=1)
    reads: tuple[_Word, ...] = ()
    ports: tuple[Annotated[int, Field(ge=1, le=65535)], ...] = ()
    variables: tuple[_Word, ...] = ()
    seconds: float = Field(120.0, gt=0.0, le=3600.0)
    memory: int = Field(2000, ge=50, le=1_000_000)


class Authors(Table):
    """The authors of a league by the names of their entries.

    Args:
        publish: True shows each author the code of all others.
    """

    publish: bool = False
    authors: dict[str, Author]


class Turn(Struct, frozen=True, kw_only=True):
    """A line of the journal of the authors.

    Args:
        author: the name of the entry. began: the local time with its offset from UTC, as ISO 8601.
        seconds: the real time that it took.
        outcome: in words. digest: the SHA-256 of the entry afterwards; empty if it has none.
        said: the end of what it has printed.
    """

    author: str
    began: str
    seconds: float
    outcome: str
    digest: str
    said: str


def read_authors(path: Path) -> Authors:
    """The authors in a file of TOML.

    Raises:
        ConfigError: it cannot be used.
    """
    try:
        found = Authors.model_validate(toml_of(read_text(path)))
    except ValidationError as error:
        raise ConfigError([f"{path}: {problem}" for problem in problems_of(error)]) from None
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    if wrong := [name for name in found.authors if not name.isidentifier()]:
        raise ConfigError(
            [f"{path}: authors: expected a name of letters, digits and _, got {name!r}" for name in wrong]
        )
    return found


def report(league: League, entry: str, *, publish: bool) -> dict[str, Any]:
    """What the author of an entry may know, as plain data: the match, the table, its versions and its last games.

    Args:
        publish: True adds the code by which all others play.
    """
    folder = league.folder
    versions = {version.label: version for version in folder.versions}
    own = {label for label, version in versions.items() if version.entry == entry}
    games = [(number, row) for number, row in enumerate(league.rows, 1) if own & {*row.game.pairing.labels}]
    errors = folder.errors / f"{entry}.txt"
    found: dict[str, Any] = {
        "entry": entry, "game": folder.definition.game, "match": without(folder.definition.match, ("secret",)),
        "table": [
            {"entry": versions[one.label].entry, "version": versions[one.label].number, "rating": round(one.value)}
            for one in league.table
        ],
        "versions": [
            {"number": version.number, "since": version.since, "problem": version.problem}
            for version in folder.versions if version.entry == entry
        ],
        "errors": errors.read_text(encoding="utf-8", errors="replace") if errors.is_file() else "",
        "games": [_game(folder, number, row, own) for number, row in games[-GAMES:]],
    }  # fmt: skip
    if publish:
        store = {contender.label: Path(contender.target) for contender in folder.definition.contenders}
        found["code"] = {
            name: store[version.label].read_text(encoding="utf-8", errors="replace")
            for name, version in league.playing.items() if name != entry and store[version.label].suffix == ".py"
        }  # fmt: skip
    return found


def _game(folder: LeagueFolder, number: int, row: GameRecord, own: set[str]) -> dict[str, Any]:
    """A game from the side of an entry, with the referee's calls and the numbers that decided them."""
    is_first = row.game.pairing.first in own
    side = row.game.first_team if is_first else row.game.second_team
    against = row.game.pairing.second if is_first else row.game.pairing.first
    marks = json.loads(folder.shown(row.game) or '{"about":{"marks":[]}}')["about"]["marks"]
    return {
        "number": number, "side": side, "against": against,
        "result": OUTCOMES[row.points if is_first else 1.0 - row.points], "score": row.played.score,
        "players": [name for name, team in row.teams.items() if team == side],
        "calls": [
            {"time": mark["time"], "rule": mark["rule"], "text": mark["text"], "why": mark["call"]["why"]}
            for mark in marks
        ],
    }  # fmt: skip


def write_version(
    name: str,
    author: Author,
    base: Path,
    entries: Path,
    place: Path,
    about: dict[str, Any],
    stopped: Callable[[float], bool],
) -> Turn:
    """Let an author write the next version of its entry.

    Args:
        base: the folder in which files of its command are looked for. entries: that of the entries.
        place: that of the authors, with one for each. about: its report.
        stopped: waits for so much real time, s; True if it is to be broken off.
    """
    folder, entry, began = place.resolve() / name, entries / f"{name}.py", time.monotonic()
    stamp, said = datetime.now().astimezone().isoformat(" ", "seconds"), ""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        # Whatever it has put in their place: a link, or a folder.
        delete(folder / "report.json")
        delete(folder / PLAYER)
        write_whole(folder / "report.json", msgspec.json.format(msgspec.json.encode(about)))
        if entry.is_file():
            write_whole(folder / PLAYER, entry.read_bytes())
        outcome, said = _run(author, base, folder, entries, stopped)
        before, after = read_entry(entry), read_entry(folder / PLAYER)
        data = b"" if after is None else b"".join(after.files.values())
        if not outcome and not os.path.lexists(folder / PLAYER):
            outcome = f"expected its entry as {PLAYER}, found none"
        elif not outcome and after is not None and after.problem:
            outcome = after.problem
        elif not outcome and before is not None and list(before.files.values()) == [data]:
            outcome = "it has changed nothing"
        elif not outcome:
            write_whole(entry, data)
            outcome = "it has written another version"
    except OSError as error:
        outcome = f"it could not write: {error}"
    now = read_entry(entry)
    return Turn(
        author=name, began=stamp, seconds=round(time.monotonic() - began, 1), outcome=outcome,
        digest=now.digest if now else "", said=said,
    )  # fmt: skip


def note(place: Path, turn: Turn) -> None:
    """Write a turn into the journal of the authors.

    Raises:
        LaunchError: it cannot be written.
    """
    with writing(f"{place}: turns.jsonl"), (place / "turns.jsonl").open("ab", buffering=0) as journal:
        write_record(journal, turn)


def _run(author: Author, base: Path, folder: Path, entries: Path, stopped: Callable[[float], bool]) -> tuple[str, str]:
    """Run the command of an author; why it failed, empty if it did not; and the end of what it has printed."""
    places = [_place(base, word, folders=False) for word in author.command]
    command = [word if place is None else str(place) for word, place in zip(author.command, places, strict=True)]
    reads = [
        place for place in (*places, *(_place(base, name, folders=True) for name in author.reads)) if place is not None
    ]
    # What is imported from where the command was typed is no library.
    known = [library for library in libraries() if library != Path.cwd()]
    ports = author.ports
    if ports:
        reads += _CA_CERTIFICATES
        ports = (*ports, _DNS_PORT)
    policy = SealPolicy(
        files=(
            *files(
                own=[], libraries=known, hidden=[entries.resolve(), folder.parents[1], base.resolve()], folder=folder,
                entries=entries_of,
            ),
            *((path, Access.READ) for path in reads),
        ),
        ports=ports, folder=folder, memory=author.memory, core=None,
    )  # fmt: skip
    names = ["PATH", "LANG", *author.variables]
    own = {name: os.environ[name] for name in names if name in os.environ}
    # Its `python3` is the one that runs this, with VRG.
    own["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), own.get("PATH", os.defpath)])
    # resolv.conf(5): names are asked for over TCP, as there is no UDP.
    own |= {"HOME": str(folder), "TMPDIR": str(folder), "RES_OPTIONS": "use-vc"}
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [
                sys.executable, "-I", "-m", author_process.__name__, str(os.getpid()), author_process.packed(policy),
                *command,
            ],
            cwd=folder, env=own, stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT,
            start_new_session=True,
        )  # fmt: skip
        until, why = time.monotonic() + author.seconds, ""
        try:
            while process.poll() is None and not why:
                if stopped(_LOOK_INTERVAL):
                    why = "it was broken off"
                elif (used := _memory(process.pid))[0] > author.memory:
                    why = f"it used more than {author.memory} MB, in {used[1]} programs"
                elif time.monotonic() > until:
                    why = f"it took longer than {author.seconds:g} s"
        finally:
            while process.poll() is None:
                process.terminate()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(_LOOK_INTERVAL)
        said.seek(max(0, said.seek(0, os.SEEK_END) - _SAID))
        words = printable(said.read(_SAID).decode("utf-8", "replace"), lines=True)
    return why or ("" if process.returncode == 0 else f"its command has ended with status {process.returncode}"), words


def _place(base: Path, word: str, *, folders: bool) -> Path | None:
    """The file that a word names, beside the table's file or by a whole path; None if it names none.

    Args:
        folders: True also takes folders, and `~`, which a program may have its own use for.
    """
    try:
        found = (base / (Path(word).expanduser() if folders else word)).resolve()
        return found if found.is_file() or (folders and found.is_dir()) else None
    except (OSError, ValueError, RuntimeError):
        return None


def _memory(pid: int) -> tuple[float, int]:
    """The memory that all use that a process has started, MB, and their number; what several share counts once."""
    try:
        found = psutil.Process(pid).children(recursive=True)
    except psutil.Error:
        return 0.0, 0  # it has ended
    return sum(map(_share, found)) / 1e6, len(found)


def _share(process: psutil.Process) -> int:
    try:
        return int(process.memory_full_info().pss)
    except psutil.AccessDenied:
        with contextlib.suppress(psutil.Error):
            return int(process.memory_info().rss)
    except psutil.Error:
        pass
    return 0


def table_of(turns: Sequence[Turn]) -> list[list[str]]:
    """The turns as a table of texts, with the last line that each author has printed."""
    last = [(one.said.strip().splitlines() or [""])[-1] for one in turns]
    rows = [[one.author, f"{one.seconds:.1f}", one.outcome, text[:80]] for one, text in zip(turns, last, strict=True)]
    return [["author", "seconds", "outcome", "its last line"], *rows]
