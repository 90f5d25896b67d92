"""The league of a class: games between what was handed in, in its own process that gives way to tries."""

import contextlib
import subprocess
import threading
import time
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec
from msgspec import Struct

from vrg.errors import FileError
from vrg.files import RECORDS_LIMIT, read_bytes, records_of
from vrg.playing.by_command import started
from vrg.system import POSIX
from vrg_class.folder import ClassFolder, Student
from vrg_league.games import GameRecord
from vrg_league.league.folder import Version, playing, targets
from vrg_league.standings import ratings

R = TypeVar("R", bound=Struct)
GAMES: Final = 4
"""The games of one call of the league: what is handed in meanwhile waits for its end."""
ENOUGH: Final = 60
"""The games after which a version needs no more."""
_PAUSE: Final = 10.0
"""The real time in s after a call that has failed."""
_NICE: Final = 15
"""How much later than tries the league gets a processor."""


class ClassLeague:
    """The league of a class, which plays between tries. `rest` and `close` are for one thread, the others for any.

    Args:
        folder: of the class. match: of its games.

    Attributes:
        games: how many were played. files: by which each student plays, by name.
    """

    def __init__(self, folder: ClassFolder, match: str) -> None:
        self._folder, self._match = folder, match
        self._process: subprocess.Popen[bytes] | None = None
        self._wanted, self._lock = any(folder.entries.iterdir()), threading.Lock()
        self._closed, self._since = False, 0.0
        self._rows: list[dict[str, Any]] = []
        self._places: dict[str, int] = {}
        self._problems: dict[str, str] = {}
        self._read = (-1, -1)
        self.files: dict[str, Path] = {}
        self.games = self._games_before = 0
        self._look()

    def renew(self) -> None:
        """Take in what was handed in, once there is time."""
        with self._lock:
            self._wanted = True

    def forget_names(self) -> None:
        """Make the board again, as names have changed or somebody has gone."""
        self._read = (-1, -1)

    def rest(self, *, rests: bool) -> None:
        """Let no games begin, or let them, and look at those that were played: to be called again and again."""
        with self._lock:
            self._rest(rests=rests)

    def _rest(self, *, rests: bool) -> None:
        self._look()
        now = time.monotonic()
        if self._process is not None and self._process.poll() is not None:
            failed = self._process.returncode != 0
            self._process, self._since = None, now + (_PAUSE if failed else 0.0)
            # A call in which nothing was played, as nobody passed the check, is not repeated.
            unsettled = any(row["games"] < ENOUGH for row in self._rows)
            self._wanted |= failed or (unsettled and self.games > self._games_before)
        if self._process is None and self._wanted and not (rests or self._closed) and now >= self._since and self._able:
            self._begin()

    @property
    def _able(self) -> bool:
        return len([file for file in self._folder.entries.iterdir() if file.suffix == ".py"]) >= 2

    def _begin(self) -> None:
        self._wanted = False
        self._games_before = self.games
        league = self._folder.league
        command = [
            "league", "play", str(self._folder.entries), "--output", str(league), "--games", str(GAMES),
            "--jobs", "1", "--new-release", *([] if (league / "versions.jsonl").exists() else ["--match", self._match]),
        ]  # fmt: skip
        with (self._folder.path / "league.log").open("ab") as log:
            self._process = started(
                command, before=["nice", "-n", str(_NICE)] if POSIX else [], stdout=log,
                stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip

    @property
    def board(self) -> list[dict[str, Any]]:
        """The rows of the leaderboard, the best first: name, rating, games, and the places climbed.

        At the end are those who have handed in and have no rating yet.
        """
        rated = {row["name"] for row in self._rows}
        waiting = [s for s in self._folder.students.values() if s.handed and s.name not in rated]
        return [*self._rows, *({
            "name": student.name, "rating": None, "games": 0, "climbed": 0, "plays": not self.problem(student),
        } for student in waiting)]  # fmt: skip

    def problem(self, student: Student) -> str:
        """Why what a student has handed in last does not play, in words; empty if it does."""
        return self._problems.get(student.folder, "")

    def _look(self) -> None:
        league = self._folder.league
        with contextlib.suppress(OSError, FileError):  # there is no league yet
            sizes = (league / "games.jsonl").stat().st_size, (league / "versions.jsonl").stat().st_size
            if sizes != self._read:
                self._rows, self._read = self._rated(league), sizes

    def _rated(self, league: Path) -> list[dict[str, Any]]:
        rows = _records(league / "games.jsonl", GameRecord)
        versions = _records(league / "versions.jsonl", Version)  # later, so that those of all games are there
        self.games = len(rows)
        current = {version.label: version for version in playing(versions).values()}
        self._problems = {version.entry: version.problem for version in versions}
        names = {student.folder: student.name for student in self._folder.students.values()}
        found: list[dict[str, Any]] = []
        files = targets(league, versions)
        self.files = {names.get(one.entry, one.entry): Path(files[one.label]) for one in current.values()}
        for rating in ratings(list(files), rows):
            version = current.get(rating.label)
            if version is not None and version.entry in names:  # one who was removed is on no board
                played = sum(rating.label in row.game.pairing.labels for row in rows)
                found.append({
                    "name": names[version.entry], "rating": round(rating.value),
                    "games": played,
                })  # fmt: skip
        before = self._places
        ranks = [row["rating"] for row in found]  # equal ratings share a place, so that nobody climbs by chance
        self._places = {row["name"]: ranks.index(row["rating"]) for row in found}
        return [
            row | {"climbed": before.get(name := row["name"], self._places[name]) - self._places[name]} for row in found
        ]

    def close(self) -> None:
        """End the games that are played. What was played is kept."""
        with self._lock:
            self._closed = True
        if self._process is not None:
            self._process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(5.0)
            self._process.kill()


def _records(path: Path, kind: type[R]) -> list[R]:
    """What the league's process has written so far: a line that it is writing now is left to the next time."""
    return list(records_of(read_bytes(path, RECORDS_LIMIT), msgspec.json.Decoder(kind)))
