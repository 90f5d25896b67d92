"""Modules: the file of one that lies beside a match file, and the import of one that prints."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

STANDARD_ERROR: Final = 2
"""The file descriptor of the standard error stream."""


def module_in(folder: Path, name: str) -> Path | None:
    """The file or the folder of a module in a folder; None for VRG itself, which is no part of a match."""
    if name == "vrg":
        return None
    if (folder / f"{name}.py").is_file():
        return folder / f"{name}.py"
    package = folder / name
    return package if package.is_dir() and any(package.glob("*.py")) else None


@contextlib.contextmanager
def silent_errors() -> Iterator[None]:
    """Drop what is written to the standard error stream meanwhile, also by libraries in C: PyBullet does at its import.

    It works on the file descriptor of the whole process, so use it around an import only. An exception is not lost.
    """
    try:
        kept = os.dup(STANDARD_ERROR)
    except OSError:  # it is closed, so nothing is printed
        yield
        return
    try:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), STANDARD_ERROR)
        yield
    finally:
        os.dup2(kept, STANDARD_ERROR)
        os.close(kept)
