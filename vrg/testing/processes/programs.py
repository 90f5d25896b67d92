"""Programs beside a match, such as a window of their own, and the screens that they are on."""

import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from vrg.testing.requirements import missing

SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_AUDIODRIVER")
"""The variables that no process inherits: tests of the windows, collected in the same run, ask SDL for no screen."""


@dataclass(frozen=True)
class Helper:
    """A program that does what lines on its standard input say; what it says is in a log."""

    process: "subprocess.Popen[str]"
    log: Path

    def do(self, *lines: str) -> None:
        """Let it do these things."""
        print(*lines, sep="\n", file=self.process.stdin, flush=True)

    def said(self) -> str:
        """What it has said so far."""
        return self.log.read_text(encoding="utf-8")


@contextlib.contextmanager
def helper(program: Path, *arguments: str, log: Path, display: str = "") -> Iterator[Helper]:
    """Run the Python of a file, with a display for its windows if it needs one, until the block ends."""
    environment = {name: value for name, value in os.environ.items() if name not in SCREENS}
    environment |= {"DISPLAY": display} if display else {}
    command = [sys.executable, str(program), *arguments]
    with log.open("wb") as said:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=said, stderr=subprocess.STDOUT, env=environment, text=True
        )
    try:
        yield Helper(process, log)
    finally:
        process.kill()
        process.wait()


@contextlib.contextmanager
def screen() -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    """A virtual screen that a test may take away: its display and its process."""
    if shutil.which("Xvfb") is None:
        missing("Xvfb is not installed: no screen for windows")
    out, into = os.pipe()
    command = ["Xvfb", "-displayfd", str(into), "-screen", "0", "1280x800x24", "-nolisten", "tcp"]
    process = subprocess.Popen(command, pass_fds=[into], stderr=subprocess.DEVNULL)
    os.close(into)
    try:
        with os.fdopen(out) as answer:
            number = answer.readline().strip()
        assert number, "Xvfb found no free display"
        yield f":{number}", process
    finally:
        process.kill()
        process.wait()
