"""Continues a recorded match in its own process, for the window of a replay."""

import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
from msgspec import Struct

from vrg.config.setup import MatchSetup
from vrg.errors import VrgError
from vrg.games import strategies_of
from vrg.games.game import capitalised
from vrg.playing.branch import last_instant
from vrg.runs.change import branch_of
from vrg.runs.result import headline, read_result, summary
from vrg.runs.run_folder import RunFolder

if TYPE_CHECKING:
    from vrg.ui.branching import Taken

Opened = Callable[[RunFolder], "Taken"]
"""Reads the recording of a run folder for the window."""


def compared(recorded: RunFolder, folder: RunFolder) -> str:
    """The ends of the recorded match and of the one that was taken up, in sentences."""
    changed = str(branch_of(folder) or "played again")
    text = f"{capitalised(changed)}: {ending_of(folder)}. Recorded: {ending_of(recorded)}."
    return f"{text} It is in {folder.path}."


def ending_of(folder: RunFolder) -> str:
    """The end of a match, in words."""
    try:
        result = read_result(folder)
        return f"{headline(result)}{summary(result)}"
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return "how it ended is not known"


class ReplayLine(Struct):
    """A line of `vrg run replay --json`: the match time that is played, s, or the new run folder."""

    time: float | None = None
    run: str | None = None


def replay_line(line: bytes) -> ReplayLine:
    """Read a line of `vrg run replay --json`. A line that another program has printed gives an empty one."""
    try:
        return msgspec.json.decode(line, type=ReplayLine)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return ReplayLine()


class ProcessBrancher:
    """Continues a match in its own process; see `vrg.ui.branching.Brancher`.

    Args:
        folder: the run folder of the recorded match. setup: of the match. runs: the folder for new run folders.
        opened: reads the recording of the new match. sandbox: the code of players' files is sealed.

    Attributes:
        players, strategies, cannot: see `vrg.ui.branching.Brancher`.
    """

    def __init__(
        self, folder: RunFolder, setup: MatchSetup, runs: Path, opened: Opened, *, sandbox: bool = True
    ) -> None:
        self.players: Sequence[str] = [player.name for player in setup.players]
        own = [player.strategy for player in setup.players]
        self.strategies: Sequence[str] = list(dict.fromkeys([*strategies_of(setup.game), *own]))
        self.cannot = "" if hasattr(os, "set_blocking") else "this needs Python 3.12 or later on Windows"
        try:
            last_instant(folder)
        except VrgError as error:
            self.cannot = str(error)
        self._folder = folder
        self._runs = runs
        self._opened = opened
        self._sealing = [] if sandbox else ["--no-sandbox"]
        self._process: subprocess.Popen[bytes] | None = None
        self._progress = ""
        self._rest = b""

    @property
    def busy(self) -> bool:
        """True if something was begun that has not ended."""
        return self._process is not None

    def begin(self, time: float, player: str, strategy: str) -> None:
        """Begin to play from a match time, s, with another strategy for a player."""
        self.close()
        # A pipe would fill up, as it is read only at the end.
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - `close` closes it
        whole = [str(self._folder.path.resolve()), "--at", f"{time:.3f}", "--play", f"{player}={strategy}"]
        whole += ["--runs", str(self._runs.resolve()), *self._sealing]
        command = [sys.executable, "-P", "-m", "vrg", "run", "replay", *whole, "--json"]
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self._errors, cwd=self._folder.path
        )
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)
        self._progress, self._rest = "repeating what was recorded", b""

    def look(self) -> "Taken | str | None":
        """Return the outcome; see `vrg.ui.branching.Brancher`."""
        if self._process is None:
            return None
        assert self._process.stdout is not None
        ended = self._process.poll() is not None
        lines = (self._rest + (self._process.stdout.read() or b"")).split(b"\n")
        self._rest = lines.pop()
        for line in map(replay_line, lines):
            if line.run is not None:
                self.close()
                return self._opened(RunFolder(Path(line.run)))
            if line.time is not None:
                self._progress = f"{line.time:.0f} s of match time are played"
        if not ended:
            return self._progress
        self._errors.seek(0)
        last = self._errors.read().decode(errors="replace").strip().splitlines()[-1:]
        self.close()
        return last[0] if last else "it has ended without a message"

    def close(self) -> None:
        """Break off what was begun. Idempotent."""
        if self._process is not None:
            self._process.terminate()
            with contextlib.suppress(ValueError, OSError):
                self._process.communicate()
            self._process = None
            self._errors.close()
