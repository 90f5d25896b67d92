"""The folder of an experiment: its definition, its matches, the record of its games, and what is made of them."""

import os
import shlex
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Self, TypeVar

import msgspec
from msgspec import Struct

from vrg.config.loading import load_match
from vrg.config.setup import CheckedMatch
from vrg.errors import ConfigError, FileError, LaunchError
from vrg.files import RECORDS_LIMIT, decoded, read_bytes, records_of, write_whole
from vrg.runs.change import Branch, Change, kept
from vrg.runs.keeping import keep
from vrg.runs.run_folder import RunFolder, delete
from vrg.system import lock
from vrg_league.experiment import Definition, written
from vrg_league.games import GameRecord, Pairing, ScheduledGame

R = TypeVar("R", bound=Struct)

DEFINITION = "experiment.json"
"""The name of the file of the definition."""
ENTRIES = "contenders"
"""The folder in that of a match with the files of each entry."""
_VERSUS = ".vs."
"""Stands between two labels, which have no dot."""
_json = msgspec.json.Encoder()


class ExperimentFolder:
    """The folder of an experiment. A context manager; while it is open, no other process can use it.

    Args:
        path: the folder. If it is missing, it is made.
        definition: the experiment. If the folder has games already, they must be of the same one.

    Attributes:
        shows: True if each game is to write what shows it to people.
        rows: all games that are in the record.
        playing: the folder for what games that are being played write.
        failures: the folder for the logs of games in which something has failed.

    Raises:
        ConfigError: the folder is that of another experiment, or has other files.
        LaunchError: it cannot be used, or another process uses it.
    """

    shows = False

    def __init__(self, path: Path, definition: Definition) -> None:
        self.path = path
        self.definition = definition
        self.playing = path / "playing"
        self.failures = path / "failures"
        self._definition = path / DEFINITION
        self._file: IO[bytes] | None = None
        self.rows: list[GameRecord] = []
        self._substitutes: dict[str, str] = {}
        try:
            self._check()
            path.mkdir(parents=True, exist_ok=True)
            self._file = (path / "games.jsonl").open("ab", buffering=0)
            if not lock(self._file):
                raise LaunchError(f"{path}: another process plays these games: wait for it, or choose another --output")
            write_whole(self._definition, msgspec.json.format(_json.encode(definition)) + b"\n")
            self.rows = self._load()
            delete(self.playing)
        except LaunchError:
            self.close()
            raise
        except OSError as error:
            self.close()
            raise LaunchError(f"{path}: cannot be used: {error.strerror}: choose another --output") from None

    def match_file(self, game: ScheduledGame) -> Path:
        """The match file of a game."""
        pairing = game.pairing
        first_plays_first_team = game.first_team == self.definition.teams[0]
        names = (pairing.first, pairing.second) if first_plays_first_team else (pairing.second, pairing.first)
        return RunFolder(self.path / "matches" / _VERSUS.join(names)).match_file

    def name_of(self, game: ScheduledGame) -> str:
        """The name of the folder for what a game writes."""
        return f"{self.match_file(game).parent.name}-{game.number}"

    def again(self, game: ScheduledGame) -> str:
        """The command that plays a game again."""
        if (origin := self.definition.origin) is not None:
            words = ["vrg", "run", "replay", origin.run, "--at", f"{origin.time:g}", "--set", f"seed={game.seed}"]
            plays = (word for name in origin.names for word in ("--play", f"{name}={self._substitute(game)}"))
            return shlex.join([*words, *plays])
        return f"vrg play {shlex.quote(str(self.match_file(game)))} --in-process --seed {game.seed}"

    def watch(self, game: ScheduledGame) -> str:
        """The command that plays a game again at the rate of a clock."""
        return self.again(game) + (" --rate 1" if self.definition.origin is None else "")

    def write_match(self, setup: CheckedMatch, game: ScheduledGame) -> CheckedMatch:
        """Write the match file of a game, with all files that it names, and return the match of this file.

        Args:
            setup: the match as its user has written it.

        Raises:
            ConfigError: the strategies cannot be put into the match file.
            LaunchError: the files cannot be written.
        """
        if self.definition.origin is not None:
            return setup
        known = {contender.label: contender for contender in self.definition.contenders}
        playing = {game.first_team: known[game.pairing.first], game.second_team: known[game.pairing.second]}
        folder = RunFolder(self.match_file(game).parent)
        try:
            folder.path.mkdir(parents=True, exist_ok=True)
            strategies = {
                team: contender.placed(folder.path, f"{ENTRIES}/{contender.label}")
                for team, contender in playing.items()
            }
            keep(written(setup, strategies, self.definition.secret), folder)
        except OSError as error:
            raise LaunchError(f"{folder.path}: cannot be written: {error.strerror}") from None
        found = load_match(folder.match_file)
        for team, target in strategies.items():
            for player in map(found.player, found.followers(team)):
                if _end(player.strategy) != _end(target):
                    text = f"expected {player.name} to play with {target}, found {player.strategy}"
                    raise ConfigError(f"{folder.match_file}: {text}: write its strategy in one line")
        return found

    def branch(self, game: ScheduledGame) -> Branch | None:
        """The branch of a game; None if it is played from the beginning.

        Raises:
            LaunchError: the strategy cannot be copied.
        """
        if (origin := self.definition.origin) is None:
            return None
        target = self._substitute(game)
        return origin.branch(game.seed, [Change(origin.time, player, target) for player in origin.players])

    def _substitute(self, game: ScheduledGame) -> str:
        """The strategy by which the team of the origin goes on in a game: of a file a copy, which is made once."""
        label = game.label(game.only or "") or ""
        if label not in self._substitutes:
            contender = next(contender for contender in self.definition.contenders if contender.label == label)
            folder = RunFolder(self.path / "matches" / label)
            try:
                target = contender.placed(folder.path, ENTRIES)
                target = f"{folder.path.resolve()}/{target}" if contender.entry else target
                self._substitutes[label] = kept(target, folder)
            except OSError as error:
                raise LaunchError(f"{folder.path}: cannot be written: {error.strerror}") from None
        return self._substitutes[label]

    def append(self, row: GameRecord) -> None:
        """Write a game to the record, and wait until it is on disk.

        Raises:
            LaunchError: it cannot be written.
        """
        if self._file is None:
            raise LaunchError(f"{self.path}: the folder is closed")
        write_record(self._file, row)
        self.rows.append(row)

    def keep(self, game: ScheduledGame, written: Path) -> None:
        """Keep what is needed later of what a game has written, before that is deleted.

        Args:
            written: the folder for the journal and the logs of the game.

        Raises:
            LaunchError: it cannot be kept.
        """

    def close(self) -> None:
        """Let others use the folder. Idempotent."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _check(self) -> None:
        """Check that what is in the folder are games of the same experiment."""
        if not self._definition.is_file():
            if self.path.is_dir() and any(self.path.iterdir()):
                text = "expected an empty folder or that of an experiment, found other files: choose another --output"
                raise ConfigError(f"{self.path}: {text}")
            return
        before = read_definition(self.path)
        differences = self.definition.differences(before)
        if differences:
            text = f"the games in it belong to another experiment: {'; '.join(differences)}: choose another --output"
            raise ConfigError(f"{self.path}: {text}")

    def _load(self) -> list[GameRecord]:
        rows: dict[tuple[Pairing, int], GameRecord] = {}
        for row in read_records(self.path / "games.jsonl", GameRecord):
            rows.setdefault((row.game.pairing, row.game.number), row)
        return list(rows.values())


def read_definition(folder: Path) -> Definition:
    """The definition of the experiment in a folder.

    Raises:
        ConfigError: it cannot be read, or is none of this release.
    """
    path = folder / DEFINITION
    try:
        return decoded(msgspec.json.Decoder(Definition), read_bytes(path))
    except (OSError, FileError) as error:
        text = f"expected the definition of an experiment of this release: {error}: choose another --output"
        raise ConfigError(f"{path}: {text}") from None


def read_records(path: Path, kind: type[R]) -> list[R]:
    """Read a file of records, one a line. What is torn behind the last whole one is removed; a missing file has none.

    A line that is damaged is left out with a warning.

    Raises:
        OSError: it cannot be read.
    """
    try:
        content = read_bytes(path, RECORDS_LIMIT)
    except FileNotFoundError:
        return []
    found = records_of(content, msgspec.json.Decoder(kind))
    if found.torn:
        os.truncate(path, len(content) - found.torn)
    found.warn(path, f"a {kind.__name__}")
    return list(found)


@contextmanager
def writing(what: str) -> Iterator[None]:
    """Raise a LaunchError if something cannot be written.

    Args:
        what: it, as the error begins.
    """
    try:
        yield
    except OSError as error:
        raise LaunchError(f"{what} cannot be written: {error.strerror}: free some space") from None


def write_record(file: IO[bytes], record: Struct) -> None:
    """Write a record at the end of a file of records, and wait until it is on disk.

    Raises:
        LaunchError: it cannot be written.
    """
    with writing(f"{file.name}:"):
        file.write(_json.encode(record) + b"\n")
        os.fsync(file.fileno())


def write_text(folder: Path, name: str, text: str) -> None:
    """Replace a file of the folder of an experiment in one step.

    Raises:
        LaunchError: it cannot be written.
    """
    with writing(f"{folder}: {name}"):
        write_whole(folder / name, text.encode())


def write_report(folder: Path, parts: Iterable[str]) -> None:
    """Write the report on an experiment into its folder.

    Args:
        parts: of it, as Markdown; empty ones are left out.

    Raises:
        LaunchError: it cannot be written.
    """
    write_text(folder, "report.md", "\n\n".join(part.strip() for part in parts if part.strip()) + "\n")


def _end(strategy: str) -> str:
    """The end of how a strategy is named, which does not change with the place of its file."""
    return Path(strategy.rpartition(":")[2]).name
