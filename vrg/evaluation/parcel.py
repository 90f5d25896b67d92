"""Folders as bytes, so that they can travel to another computer and back."""

import io
import os
import tarfile
from pathlib import Path

from vrg.errors import LaunchError


def packed(folder: Path) -> bytes:
    """All files in a folder and below it, but no links.

    Raises:
        LaunchError: one cannot be read.
    """
    content = io.BytesIO()
    try:
        with tarfile.open(fileobj=content, mode="w:gz") as tar:
            found = (Path(place, name) for place, _, names in os.walk(folder) for name in names)
            for file in sorted(path for path in found if path.is_file() and not path.is_symlink()):
                tar.add(file, file.relative_to(folder).as_posix(), recursive=False)
    except OSError as error:
        raise LaunchError(f"{folder}: cannot be sent: {error.strerror}") from None
    return content.getvalue()


def unpack(content: bytes, folder: Path) -> None:
    """Write the files of a folder that was packed. Nothing is written outside the folder.

    Raises:
        LaunchError: these are no packed files, or they cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:gz") as tar:
            tar.extractall(folder, filter="data")
    except (OSError, tarfile.TarError, EOFError) as error:
        raise LaunchError(f"{folder}: expected packed files: {error}") from None
