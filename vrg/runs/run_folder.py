"""The folder of a run, with all files that the run writes."""

import os
import secrets
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from vrg.config.setup import MatchSetup, write_setup
from vrg.errors import LaunchError
from vrg.system import FILE_FLAGS, lock


class RunFolder:
    """A run folder, and the paths of the files in it.

    Attributes:
        path: the folder. match_file: the match file as it was played.
        setup: the set-up of the checked match, for its processes. setups: the folder of the players' set-ups.
        secret_file: the secret of the match; see `secret`.
        journal: the referee's journal. evidence: what the referee decided by.
        fingerprint: what computed the match; see `vrg.runs.fingerprint`.
        events: what happened to the processes of the match, as its launcher noticed it.
        recording: the first part of the recording, for Foxglove. layout: the layout in which Foxglove shows it.
        steps: the log of steps of a match in one process or in lockstep.
        branch: what was changed, in the run folder of a match that was taken up from another one.
        snapshot: the snapshot from which a restarted world goes on.
        logs: the folder with one log per process.
        result: the result of the match. plot: the plot of the trajectories. heights: that of who flew.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.match_file = path / "match.toml"
        self.setup = path / "setup.json"
        self.setups = path / "setups"
        self.secret_file = path / "secret"
        self.journal = path / "journal.jsonl"
        self.evidence = path / "evidence.bin"
        self.fingerprint = path / "fingerprint.json"
        self.events = path / "events.jsonl"
        self.recording = path / "recording.mcap"
        self.steps = path / "steps.jsonl"
        self.branch = path / "branch.json"
        self.layout = path / "foxglove-layout.json"
        self.snapshot = path / "world.snapshot"
        self.logs = path / "logs"
        self.result = path / "result.json"
        self.plot = path / "trajectories.png"
        self.heights = path / "heights.png"

    @classmethod
    def create(cls, parent: Path, match: str, now: datetime) -> "RunFolder":
        """Make a folder that no other run has.

        Args:
            parent: the folder to make it in. match: the name of the match.
            now: the local real time, for the folder's name.

        Raises:
            LaunchError: the folder cannot be made.
        """
        stem = f"{match}-{now:%Y%m%d-%H%M%S}"
        for attempt in range(1, 1000):
            folder = cls(parent / (stem if attempt == 1 else f"{stem}-{attempt}"))
            try:
                folder.path.mkdir(parents=True)
                folder.prepare()
            except FileExistsError as error:
                if not parent.is_dir():  # such as a link to nothing
                    raise _unusable(parent, error) from error
                continue
            except OSError as error:
                raise _unusable(folder.path, error) from error
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

    def setup_of(self, name: str) -> Path:
        """The set-up of the match as the process of a player gets it."""
        return self.setups / f"{name}.json"

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
            with suppress(FileNotFoundError):
                if known := path.read_text():
                    return known
            with open(os.open(path, os.O_RDWR | os.O_CREAT | FILE_FLAGS, 0o600), "r+") as file:
                lock(file, wait=True)
                # Another process may have drawn one just now; where the disk was full, an empty file was left.
                if not (known := file.read()):
                    file.write(known := secrets.token_hex(16))
                    file.flush()
                return known
        except OSError as error:
            raise LaunchError(f"{path}: cannot be written or read: {error.strerror}: choose another place") from error

    def explanation(self, number: int) -> Path:
        """The picture that shows why a call was made."""
        return self.path / f"why-{number}.png"

    @property
    def again(self) -> Path:
        """The file that is there if a person at the window wants to watch the match again."""
        return self.path / "watch-again"

    def again_if_recorded(self) -> Path | None:
        """That file; None if there is no recording that could be watched."""
        return self.again if self.recordings() else None

    def recordings(self) -> list[Path]:
        """Every part of the recording. A recorder that was started again begins a new part."""
        parts = self.path.glob(f"{self.recording.stem}*{self.recording.suffix}")
        return sorted(parts, key=lambda part: (len(part.name), part.name))

    def of_player(self, name: str) -> Path:
        """The folder in which a sealed player may write."""
        return self.path / "players" / name


def delete(folder: Path) -> None:
    """Delete a folder and all that is in it, as far as that can be done. One that is missing is no error."""
    try:
        shutil.rmtree(folder, ignore_errors=True)
    except RecursionError:  # a strategy may have made thousands of folders within one another
        subprocess.run(["rm", "-rf", "--", str(folder)], check=False, stderr=subprocess.DEVNULL)


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A private temporary folder in which strategies may write; it is deleted with all that is in it."""
    folder = Path(tempfile.mkdtemp(prefix="vrg-"))
    try:
        yield folder
    finally:
        delete(folder)


def _unusable(path: Path, error: OSError) -> LaunchError:
    return LaunchError(f"{path}: the run folder cannot be made: {error.strerror}: choose another place")
