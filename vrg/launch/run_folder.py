"""What a run leaves behind: one folder with everything."""

import json
import os
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from vrg.errors import LaunchError


@dataclass(frozen=True)
class RunFolder:
    """The files of one run, by name."""

    path: Path

    @classmethod
    def create(cls, parent: Path, match: str, now: datetime, text: str) -> "RunFolder":
        """Make a folder that no other run has, with the match file in it.

        Args:
            now: local real time, for the folder's name.
            text: of the match file as it is played, overrides included.

        Raises:
            LaunchError: the folder cannot be made.
        """
        stem = f"{match}-{now:%Y%m%d-%H%M%S}"
        for attempt in range(1, 1000):
            path = parent / (stem if attempt == 1 else f"{stem}-{attempt}")
            try:
                path.mkdir(parents=True)
            except FileExistsError:
                continue
            except OSError as error:
                raise _unusable(path, error) from error
            folder = cls(path)
            folder.prepare()
            try:
                folder.match_file.write_text(text, encoding="utf-8")
            except OSError as error:
                raise _unusable(path, error) from error
            return folder
        raise LaunchError(f"{parent / stem}: a thousand runs in one second")

    def prepare(self) -> None:
        """Make what is missing of the folder.

        Raises:
            LaunchError: it cannot be made.
        """
        try:
            self.logs.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _unusable(self.path, error) from error

    @property
    def match_file(self) -> Path:
        """As it was played."""
        return self.path / "match.toml"

    @property
    def setup(self) -> Path:
        """The checked match, for its processes."""
        return self.path / "setup.json"

    @property
    def journal(self) -> Path:
        """The referee's."""
        return self.path / "journal.jsonl"

    @property
    def recording(self) -> Path:
        """For Foxglove."""
        return self.path / "recording.mcap"

    def recordings(self) -> list[Path]:
        """Every part of the recording: a recorder that was started again begins a new one."""
        parts = self.path.glob(f"{self.recording.stem}*{self.recording.suffix}")
        return sorted(parts, key=lambda part: (len(part.name), part.name))

    @property
    def snapshot(self) -> Path:
        """The world's, from which a restarted world goes on."""
        return self.path / "world.snapshot"

    @property
    def logs(self) -> Path:
        """One log a process."""
        return self.path / "logs"

    @property
    def result(self) -> Path:
        """Who won."""
        return self.path / "result.json"

    @property
    def plot(self) -> Path:
        """The trajectories."""
        return self.path / "trajectories.png"


def _unusable(path: Path, error: OSError) -> LaunchError:
    return LaunchError(f"{path}: the run folder cannot be made: {error.strerror}: choose another place")


def write_whole(path: Path, data: bytes) -> None:
    """Replace a file so that a reader sees the old or the new content, never a part.

    Raises:
        OSError: it cannot be written; the old content is still there.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_bytes(data)
        os.replace(partial, path)
    except OSError:
        partial.unlink(missing_ok=True)
        raise


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a JSON file for people and scripts."""
    write_whole(path, (json.dumps(content, indent=2) + "\n").encode())
