"""The folder of a run, with all files that the run writes."""

import json
import os
import secrets
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from vrg.config.setup import MatchSetup, write_setup
from vrg.errors import LaunchError


@dataclass(frozen=True)
class RunFolder:
    """The run folder at `path`, and the paths of the files in it."""

    path: Path

    @classmethod
    def create(cls, parent: Path, match: str, now: datetime, text: str) -> "RunFolder":
        """Make a folder that no other run has, with the match file in it.

        Args:
            parent: the folder to make it in. match: the name of the match.
            now: the local real time, for the folder's name.
            text: the text of the match file as it is played, overrides included.

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
        """Make the folder and its folder for logs, if they are missing.

        Raises:
            LaunchError: they cannot be made.
        """
        try:
            self.logs.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _unusable(self.path, error) from error

    @property
    def match_file(self) -> Path:
        """The match file as it was played."""
        return self.path / "match.toml"

    @property
    def setup(self) -> Path:
        """The set-up of the checked match, for its processes."""
        return self.path / "setup.json"

    def setup_of(self, name: str) -> Path:
        """The set-up of the match as the process of a player gets it."""
        return self.setups / f"{name}.json"

    @property
    def setups(self) -> Path:
        """The folder of the players' set-ups."""
        return self.path / "setups"

    @property
    def secret_file(self) -> Path:
        """The secret of the match; see `secret`."""
        return self.path / "secret"

    def hand_out(self, setup: MatchSetup) -> None:
        """Write the set-up of the match for its processes, and for each player's process one of its own.

        Raises:
            LaunchError: a file cannot be written.
        """
        write_setup(setup, self.setup)
        self.setups.mkdir(mode=0o700, exist_ok=True)
        for player in setup.players:
            write_setup(setup.for_player(player.name), self.setup_of(player.name))

    def secret(self) -> str:
        """The secret of the match that is played here. It is drawn at the first call, and outlives a restart.

        Raises:
            LaunchError: its file cannot be written or read.
        """
        path = self.secret_file
        try:
            try:
                with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
                    file.write(secrets.token_hex(16))
            except FileExistsError:
                pass
            return path.read_text()
        except OSError as error:
            raise LaunchError(f"{path}: cannot be written or read: {error.strerror}: choose another place") from error

    @property
    def journal(self) -> Path:
        """The referee's journal."""
        return self.path / "journal.jsonl"

    @property
    def evidence(self) -> Path:
        """What the referee decided by."""
        return self.path / "evidence.bin"

    def explanation(self, number: int) -> Path:
        """The picture that shows why a call was made."""
        return self.path / f"why-{number}.png"

    @property
    def events(self) -> Path:
        """What happened to the processes of the match, as its launcher noticed it."""
        return self.path / "events.jsonl"

    @property
    def recording(self) -> Path:
        """The first part of the recording, for Foxglove."""
        return self.path / "recording.mcap"

    def recordings(self) -> list[Path]:
        """Every part of the recording. A recorder that was started again begins a new part."""
        parts = self.path.glob(f"{self.recording.stem}*{self.recording.suffix}")
        return sorted(parts, key=lambda part: (len(part.name), part.name))

    @property
    def branch(self) -> Path:
        """What was changed, in the run folder of a match that was taken up from another one."""
        return self.path / "branch.json"

    @property
    def layout(self) -> Path:
        """The layout in which Foxglove shows the recording."""
        return self.path / "foxglove-layout.json"

    @property
    def snapshot(self) -> Path:
        """The snapshot from which a restarted world goes on."""
        return self.path / "world.snapshot"

    @property
    def logs(self) -> Path:
        """The folder with one log per process."""
        return self.path / "logs"

    def of_player(self, name: str) -> Path:
        """The folder in which a sealed player may write."""
        return self.path / "players" / name

    @property
    def result(self) -> Path:
        """The result of the match."""
        return self.path / "result.json"

    @property
    def plot(self) -> Path:
        """The plot of the trajectories."""
        return self.path / "trajectories.png"


def _unusable(path: Path, error: OSError) -> LaunchError:
    return LaunchError(f"{path}: the run folder cannot be made: {error.strerror}: choose another place")


def write_whole(path: Path, data: bytes) -> None:
    """Replace a file in one step, so that a reader sees either the old or the new content, never a part of it.

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
    """Write a JSON file for people and scripts.

    Raises:
        OSError: it cannot be written; the old content is still there.
    """
    write_whole(path, (json.dumps(content, indent=2) + "\n").encode())
