"""Checks that results can be written, before the work, so that none is lost."""

import os
from pathlib import Path

from vrg.errors import ConfigError


def check_place(option: str, file: Path, *besides: str, ending: str = ".npz", replace: bool) -> None:
    """Check that a file can be written, and those of the same name with other endings.

    Args:
        option: that names the file. besides: the endings of the others. ending: that it must have.
        replace: whether files that are there may be overwritten.

    Raises:
        ConfigError: they cannot.
    """
    if file.suffix != ending:
        raise ConfigError(f"{option}: expected a file NAME{ending}, got {file}")
    if not os.access(file.parent, os.W_OK):
        what = "you may not write into this folder" if file.parent.is_dir() else "no such folder: make it"
        raise ConfigError(f"{option} {file}: {file.parent}: {what}, or choose another place")
    for path in (file, *map(file.with_suffix, besides)):
        if os.path.lexists(path) and not path.is_file():
            raise ConfigError(f"{option} {file}: {path} is there, and no file: choose another name")
        if path.exists() and not replace:
            raise ConfigError(f"{path}: already there: choose another name by {option}, or overwrite it by --replace")
