"""The folder of an agent's players. A player is a file of Python directly in it, and named by its name alone."""

import importlib.util
import os
import re
import stat
from pathlib import Path
from typing import Final

from vrg.errors import ConfigError
from vrg.files import read_text, write_whole
from vrg_mcp.answers import CODE, known, shown

NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}\.py", re.ASCII)
MOST: Final = 100
"""The number of players that the folder may have."""
_DEVICES: Final = re.compile(r"con|prn|aux|nul|(com|lpt)\d", re.IGNORECASE)


class PlayerFolder:
    """The folder of an agent's players.

    Args:
        path: the folder, which is made.

    Attributes:
        path: the folder. runs: the folder in it for run folders.

    Raises:
        ConfigError: it cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.runs = path.resolve(), path.resolve() / "agent-runs"
        try:
            self.runs.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(f"{path}: the folder of the players cannot be made: {error.strerror}") from None

    def names(self) -> list[str]:
        """The names of the players' files, sorted.

        Raises:
            ConfigError: the folder cannot be read, as when a person has moved it.
        """
        try:
            with os.scandir(self.path) as entries:
                return sorted(e.name for e in entries if NAME.fullmatch(e.name) and e.is_file(follow_symlinks=False))
        except OSError as error:
            raise ConfigError(f"the folder of the players cannot be read: {error.strerror}: tell the person") from None

    def path_of(self, name: str) -> Path:
        """The file of a player that is there.

        Raises:
            ConfigError: there is none of this name.
        """
        return self.path / known("player", name, self.names())

    def read(self, name: str) -> str:
        """The code of a player.

        Raises:
            ConfigError: there is none of this name, or it cannot be read.
        """
        try:
            return read_text(self.path_of(name), CODE)
        except (OSError, ValueError) as error:
            raise ConfigError(f"{name}: cannot be read: {error}") from None

    def write(self, name: str, code: str) -> bool:
        """Write the code of a player; whether the file is a new one.

        Args:
            name: such as `ann.py`. code: up to CODE bytes in UTF-8.

        Raises:
            ConfigError: the name or the code cannot be used, or the file cannot be written.
        """
        path, there = self.path / _checked(name), self.names()
        data = code.encode(errors="backslashreplace")
        if len(data) > CODE or b"\0" in data:
            raise ConfigError(f"code: expected up to {CODE} bytes of Python without NUL, got {len(data)} bytes")
        if name not in there and len(there) >= MOST:
            raise ConfigError(f"the folder has {MOST} players, which is the most: write over one of them")
        try:
            if path.is_symlink() or (path.exists() and not stat.S_ISREG(path.lstat().st_mode)):
                raise ConfigError(f"{name}: expected a regular file, found a link or a folder: choose another name")
            write_whole(path, data)
        except OSError as error:
            raise ConfigError(f"{name}: cannot be written: {error.strerror}") from None
        return name not in there


def _checked(name: str) -> str:
    """The name of a file that may be written.

    Raises:
        ConfigError: it is not one, or the file could hide a module.
    """
    if not NAME.fullmatch(name):
        wanted = "the name of a file without a folder, up to 40 letters, digits and _, such as ann.py"
        raise ConfigError(f"file: expected {wanted}, got {shown(name)!r}")
    stem = name.removesuffix(".py")
    if _DEVICES.fullmatch(stem) or importlib.util.find_spec(stem) is not None:
        raise ConfigError(f"file: {name} could hide the module or the device {stem}: choose another name")
    return name
