"""The folder of a league: its settings, the versions of its entries, the record of its games, and what is kept."""

import gzip
import os
import shlex
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import IO

from msgspec import Struct, structs

from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError, FileError, LaunchError
from vrg.files import read_bytes, write_whole
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder, delete
from vrg_league.contenders import Contender
from vrg_league.entries import Source
from vrg_league.experiment import Definition
from vrg_league.folder import ExperimentFolder, read_records, write_record, writing
from vrg_league.games import ScheduledGame
from vrg_league.playing import SHOWN

VERSIONS = "versions"
"""The name of the folder with the files of each version."""


class Version(Struct, frozen=True, kw_only=True):
    """A line of the record of versions: from now on an entry plays by this version, or this one has failed the check.

    Args:
        entry: the name of the entry. number: counts its versions from 1. digest: the SHA-256 of its content.
        file: the name of the file or folder from which it came.
        since: the wall time, as `2026-11-26 02:00`. target: its strategy, in the folder of the versions.
        problem: why it cannot play, in words; empty if it can.
        overdue: True if it cannot because its check took too long, as on a busy computer: it is checked again.
    """

    entry: str
    number: int
    digest: str
    file: str
    since: str
    target: str = ""
    problem: str = ""
    overdue: bool = False

    @property
    def label(self) -> str:
        """Its label in the record of games: names of entries have no dot."""
        return f"{self.entry}.{self.number}"


def playing(versions: Iterable[Version]) -> dict[str, Version]:
    """The version by which each entry plays: the last one in the record that has passed the check."""
    return {version.entry: version for version in versions if not version.problem}


def targets(folder: Path, versions: Iterable[Version]) -> dict[str, str]:
    """The strategies of the versions that have passed the check, by their labels.

    Args:
        folder: that of the league.
    """
    store = folder.resolve() / VERSIONS
    return {version.label: str(store / version.target) for version in versions if not version.problem}


class LeagueFolder(ExperimentFolder):
    """The folder of a league; see ExperimentFolder. Only its owner may look into it, as it has the code of all.

    Args:
        definition: what its games depend on, without contenders. setup: the match, for a folder that is to be made.
        another: True goes on although VRG has changed.

    Attributes:
        versions: the record of versions. errors: the folder with a file of errors for each author.
    """

    shows = True

    def __init__(
        self, path: Path, definition: Definition, setup: CheckedMatch | None = None, *, another: bool = False
    ) -> None:
        self._record: IO[bytes] | None = None
        self._another = another
        if setup is not None:
            # Before the definition, without which there is no league yet.
            self._make(path, setup)
        super().__init__(path, definition)
        self.errors = path / "errors"
        self._store, self._games = path / VERSIONS, path / "kept"
        try:
            self._record = (path / "versions.jsonl").open("ab", buffering=0)
            self.versions = read_records(path / "versions.jsonl", Version)
        except OSError as error:
            self.close()
            raise LaunchError(f"{path}: cannot be used: {error.strerror}") from None
        self._know()

    @staticmethod
    def _make(path: Path, setup: CheckedMatch) -> None:
        """Make the folder of a league with its match; what an attempt that was interrupted has left is replaced."""
        with writing(f"{path}:"):
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
            if {file.name for file in path.iterdir()} - {"match", ".gitignore"}:
                what = "expected an empty folder, found other files: choose another --output"
                raise ConfigError([f"{path}: {what}"])
            path.chmod(0o700)
            delete(path / "match")
            (path / "match").mkdir()
            keep(setup, RunFolder(path / "match"))
            (path / ".gitignore").write_text("*\n")

    def add(self, version: Version) -> None:
        """Write a version to the record.

        Raises:
            LaunchError: it cannot be written.
        """
        if self._record is None:
            raise LaunchError(f"{self.path}: the folder is closed")
        write_record(self._record, version)
        self.versions.append(version)
        self._know()

    def store(self, label: str, source: Source) -> Path:
        """Copy an entry, and return the copy of the file of its strategy.

        Raises:
            LaunchError: it cannot be written.
        """
        folder = self._store / label
        with writing(f"{folder}:"):
            delete(folder)
            return source.write(folder)

    def in_store(self, target: str) -> str:
        """A strategy of the store as the record has it: without the folder of the versions."""
        return os.path.relpath(target, self._store.resolve())

    def keep(self, game: ScheduledGame, written: Path) -> None:
        """Keep the journal of a game, and what shows it to people."""
        source, target = RunFolder(written), self.kept(game)
        with writing(f"{target}:"):
            target.mkdir(parents=True, exist_ok=True)
            for file in (source.journal, written / SHOWN):
                if file.exists():
                    shutil.copy2(file, target)

    def kept(self, game: ScheduledGame) -> Path:
        """The folder of what is kept of a game."""
        return self._games / self.name_of(game)

    def shown(self, game: ScheduledGame) -> str:
        """What shows a game to people; empty if that is not known."""
        try:
            return gzip.decompress(read_bytes(self.kept(game) / SHOWN)).decode()
        except (OSError, EOFError, FileError, ValueError):
            return ""

    def again(self, game: ScheduledGame) -> str:
        """The command that plays a game again, in the folder of the league: pages leave out where that is."""
        file = self.match_file(game).relative_to(self.path)
        return f"vrg play {shlex.quote(str(file))} --lockstep --seed {game.seed}"

    def write_errors(self, entry: str, text: str) -> None:
        """Write the errors of an entry, which only the owner of the league can read; an empty text deletes them.

        Raises:
            LaunchError: they cannot be written.
        """
        file = self.errors / f"{entry}.txt"
        with writing(f"{file}:"):
            if not text:
                file.unlink(missing_ok=True)
                return
            self.errors.mkdir(mode=0o700, exist_ok=True)
            write_whole(file, text.encode(errors="backslashreplace"), 0o600)

    def close(self) -> None:
        """See ExperimentFolder.close."""
        super().close()
        if self._record is not None:
            self._record.close()
            self._record = None

    def _check(self) -> None:
        if self._definition.is_file() and not self._another:
            super()._check()

    def _know(self) -> None:
        """Let games be played by all versions that have passed the check."""
        known = targets(self.path, self.versions)
        contenders = [Contender(label=label, target=target) for label, target in known.items()]
        self.definition = structs.replace(self.definition, contenders=contenders)
