"""The configurator's access to its folder: match files, maps, strategies, and recent matches."""

import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from vrg.errors import ConfigError, FileError
from vrg.files import read_text, toml_of, write_whole
from vrg.games import is_strategy_file
from vrg.modules import classes_in
from vrg.runs.result import headline, read_result, summary
from vrg.runs.run_folder import RunFolder
from vrg_edit.choices import Choices
from vrg_edit.draft import Draft

MOST_RECENT: Final = 12
"""The number of recent matches that are listed."""
_MAX_FILE_SIZE: Final = 200_000
"""The size in bytes above which a file is taken for something else."""
_MOST_FILES: Final = 300
"""The number of files of a folder that are read."""


@dataclass(frozen=True)
class Recent:
    """A match that was played lately, or a match file of this folder.

    Args:
        name: of the match. game: its name. when: the local time in words. ending: how it ended, in words; empty for a
            file that only waits to be played.
        match: the match file. run: the run folder; None for a file. recorded: the run can be watched again.
        base: the folder that relative paths of the file start from.
    """

    name: str
    game: str
    when: str
    ending: str
    match: Path
    base: Path
    run: Path | None = None
    recorded: bool = False

    @property
    def where(self) -> str:
        """The name of the run folder or of the file, which tells it from others of its name."""
        return (self.run or self.match).name


def open_draft(file: Path) -> Draft:
    """Read a match file to change it.

    Raises:
        ConfigError: there is no such file, or it cannot be read.
    """
    try:
        return Draft(read_text(file), file.resolve().parent, file)
    except FileNotFoundError:
        raise ConfigError(f"{file}: no such file") from None
    except (OSError, FileError) as error:
        raise ConfigError(f"{file}: cannot be read: {error}") from None


def save_draft(draft: Draft, known: str | None) -> None:
    """Write a draft to its file.

    Args:
        known: the text that the file may hold where it is replaced; None for any text.

    Raises:
        FileExistsError: the file holds another text.
        OSError: it cannot be written.
    """
    assert draft.file is not None
    if known is not None and draft.file.exists() and text_in(draft.file) != known:
        raise FileExistsError(draft.file)
    write_whole(draft.file, draft.text.encode())


def text_in(file: Path) -> str | None:
    """The text of a file; None if it cannot be read."""
    try:
        return read_text(file)
    except (OSError, FileError):
        return None


def choices_in(folder: Path) -> Choices:
    """The maps and the strategies in the files of a folder."""
    maps = tuple(path.name for path, table in _tables(folder) if "bounds" in table)
    return Choices(maps, tuple(_strategies(folder)))


def recent_matches(runs: Path, folder: Path) -> list[Recent]:
    """The matches that were played lately, and the match files of a folder: the newest first."""
    found = [(when, recent) for path in _newest(runs) if (recent := _run(path, when := _time(path))) is not None]
    for path, table in _tables(folder):
        if isinstance(table.get("players"), list) and "game" in table:
            when = _time(path)
            name = str(table.get("name", path.stem))
            found.append((when, Recent(name, str(table["game"]), _local(when), "", path, folder)))
    found.sort(key=lambda pair: pair[0], reverse=True)
    return [recent for _, recent in found[:MOST_RECENT]]


def _newest(runs: Path) -> list[Path]:
    try:
        folders = [path for path in runs.iterdir() if path.is_dir()]
    except OSError:
        return []
    return sorted(folders, key=_time, reverse=True)[:MOST_RECENT]


def _run(path: Path, when: float) -> Recent | None:
    """The match of a run folder; None if it is no run folder."""
    folder = RunFolder(path)
    if not folder.match_file.is_file():
        return None
    name, game, end = path.name, "", "broken off"
    try:
        result = read_result(folder)
        name, game = str(result["match"]), str(result["game"])
        end = f"{headline(result)}{summary(result)}"
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        table = _table(folder.match_file) or {}
        name, game = str(table.get("name", name)), str(table.get("game", game))
    recorded = folder.setup.is_file() and bool(folder.recordings())
    return Recent(name, game, _local(when), end, folder.match_file, path.resolve(), path, recorded)


def _time(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _local(when: float) -> str:
    return f"{datetime.fromtimestamp(when):%d %b %H:%M}"


def _tables(folder: Path) -> Iterator[tuple[Path, dict[str, Any]]]:
    """The files of a folder that are TOML, with what they say."""
    for path in sorted(folder.glob("*.toml"))[:_MOST_FILES]:
        table = _table(path)
        if table is not None:
            yield path, table


def _table(path: Path) -> dict[str, Any] | None:
    """The content of a file; None if it cannot be read as TOML."""
    try:
        return toml_of(read_text(path, _MAX_FILE_SIZE))
    except (OSError, FileError, tomllib.TOMLDecodeError):
        return None


def _strategies(folder: Path) -> Iterator[str]:
    """The classes in the Python files of a folder that are strategies, as far as their text tells, and the policies."""
    for path in sorted(folder.glob("*.py"))[:_MOST_FILES]:
        with suppress(OSError):
            if path.stat().st_size <= _MAX_FILE_SIZE:
                yield from (f"{path.name}:{name}" for name, kind in classes_in(path).items() if kind.acts)
    yield from (path.name for path in sorted(folder.iterdir())[:_MOST_FILES] if is_strategy_file(path.name))
