"""A run folder is complete: the files that a match names are copied into it, so that it can be played again.

Files beside the match file keep their place, so that the match file in the run folder finds them. Others are put into
the folder `files`, and the copy of the match file names them there.
"""

import os
import shutil
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from vrg.config.code_files import imported
from vrg.config.setup import CheckedMatch, MatchSetup
from vrg.files import write_json, write_whole
from vrg.games import file_of
from vrg.hal.sensors.depiction import Rays
from vrg.localisation.source import read_source
from vrg.modules import module_in
from vrg.recording.layout import foxglove_layout
from vrg.regions import surrounding
from vrg.runs.run_folder import RunFolder

LEAST_SHOWN = 20.0
"""The width of what Foxglove's camera shows at least, m."""
FILES = "files"
"""The folder for files that are not beside the match file."""


def files_of(setup: CheckedMatch) -> "Kept":
    """The files that a match names: strategies and modules beside them, the map, and what backends and sources read."""
    base = Path(setup.base)
    kept = Kept(base, setup.text)
    for player in setup.players:
        file, (module, colon, _) = file_of(player.strategy), player.strategy.rpartition(":")
        if file is not None:
            kept.keep(file)
        elif colon and (source := module_in(base, module.split(".")[0])) is not None:
            kept.keep(str(source.relative_to(base)))
    if setup.map.endswith(".toml") or "/" in setup.map:
        kept.keep(os.path.relpath(setup.map, base) if Path(setup.map).is_relative_to(base) else setup.map)
    for _, settings, robots in setup.backend_settings():
        for file in settings.files(robots):
            kept.keep(file)
    for kind, table in map(read_source, setup.localisation.values()):
        for file in kind.files(table):
            kept.keep(file)
    return kept


def files_of_strategy(strategy: str, place: Path) -> tuple[str, dict[Path, Path]]:
    """A strategy that is put into a folder of its own in the run folder.

    Args:
        strategy: as `vrg.config.setup.PlayerSetup.strategy`. place: that folder, in the run folder.

    Returns:
        the strategy there, and the source of each file or package that it needs, by its path in the run folder. A
        strategy that is no file is the same everywhere.
    """
    file = file_of(strategy)
    if file is None:
        return strategy, {}
    source = Path(file)
    copies = {place / beside.name: beside for beside in (source, *imported(source))}
    return (place / source.name).as_posix() + strategy.removeprefix(file), copies


def copy_into(folder: RunFolder, copies: Mapping[Path, Path]) -> None:
    """Copy files and packages into a run folder.

    Args:
        copies: the source of each copy, by its path in the run folder.

    Raises:
        OSError: one cannot be copied.
    """
    for place, source in copies.items():
        target = folder.path / place
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            ignore = partial(_left_out, folder, source.resolve())
            shutil.copytree(source, target, dirs_exist_ok=True, ignore=ignore)
        else:
            shutil.copy2(source, target)


def keep(setup: CheckedMatch, folder: RunFolder) -> None:
    """Write the match file into the run folder, with copies of the files that it names.

    Raises:
        OSError: one cannot be copied; the match file then names them where they are.
    """
    text = setup.text
    try:
        kept = files_of(setup)
        copy_into(folder, kept.copies)
        text = kept.text
    finally:
        write_whole(folder.match_file, text.encode())


def keep_layout(setup: MatchSetup, folder: RunFolder) -> None:
    """Write the layout in which Foxglove shows the recording of this match.

    Raises:
        OSError: it cannot be written.
    """
    scans = {
        player.name: [f"{spec.kind}/{spec.name}" for spec in player.robot.sensors if spec.depiction is Rays]
        for player in setup.players
    }
    bounds = [(player.pose.x, player.pose.y, player.pose.x, player.pose.y) for player in setup.players]
    bounds += [obstacle.bounds for obstacle in setup.obstacles]
    x_min, y_min, x_max, y_max = surrounding(bounds)
    middle = ((x_min + x_max) / 2, (y_min + y_max) / 2)
    width = max(x_max - x_min, y_max - y_min, LEAST_SHOWN)
    write_json(folder.layout, foxglove_layout(scans, middle, width))


def _left_out(folder: RunFolder, package: Path, at: str, names: list[str]) -> list[str]:
    """The names in a package that are not copied: files that Python makes by itself, and the folders of runs.

    Links that lead out of it are not copied either: the match may be a stranger's.
    """
    own = folder.path.resolve()

    def leads_out(path: Path) -> bool:
        return path.is_symlink() and not path.resolve().is_relative_to(package)

    def is_run(path: Path) -> bool:
        return path.resolve() == own or ((path / folder.match_file.name).is_file() and (path / "logs").is_dir())

    return [name for name in names if name == "__pycache__" or name.startswith(".") or is_run(Path(at, name))
            or leads_out(Path(at, name))]  # fmt: skip


class Kept:
    """The parts of a match that are kept besides its results.

    Args:
        base: the folder that relative paths start from. text: that of the match file.

    Attributes:
        text: the match file, which names the copies.
        copies: the source of each copy, by its path in the run folder.
    """

    def __init__(self, base: Path, text: str) -> None:
        self._base = base.resolve()
        self._folders: dict[Path, Path] = {}
        self.text = text
        self.copies: dict[Path, Path] = {}

    def keep(self, name: str) -> None:
        """Keep a file, and the modules beside it that it imports if it is a Python file.

        Args:
            name: the path as the match file has it.
        """
        source = (self._base / name).resolve()
        if not source.exists():
            return
        place = self._place(source)
        if not source.is_relative_to(self._base):
            for quote in "\"'":
                for end in (quote, ":"):
                    self.text = self.text.replace(f"{quote}{name}{end}", f"{quote}{place.as_posix()}{end}")
        self.copies[place] = source
        for beside in imported(source):
            self.copies[self._place(beside)] = beside

    def _place(self, source: Path) -> Path:
        if source.is_relative_to(self._base):
            return source.relative_to(self._base)
        number = len(self._folders) + 1
        folder = self._folders.setdefault(source.parent, Path(FILES, str(number)))
        return folder / source.name
