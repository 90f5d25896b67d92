"""Plain `vrg` on a screen: a person changes a match by keys, saves it, and it is played in the same terminal."""

import contextlib
import os
import pty
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.requirements import missing
from tests.system.harness import DEADLINE
from vrg.config.loading import load_match

pytestmark = pytest.mark.system


class Terminal:
    """A terminal in which plain `vrg` was typed, and what it has said."""

    def __init__(self, folder: Path, display: str) -> None:
        root = str(Path(__file__).parents[2])
        gone = ("WAYLAND_DISPLAY", "SDL_VIDEODRIVER")
        environment = {name: value for name, value in os.environ.items() if name not in gone}
        environment |= {"DISPLAY": display, "SDL_AUDIODRIVER": "dummy", "PYTHONPATH": root}
        self._fd, inner = pty.openpty()
        command = [sys.executable, "-P", "-m", "vrg"]
        self.process = subprocess.Popen(
            command, stdin=inner, stdout=inner, stderr=inner, cwd=folder, env=environment, start_new_session=True
        )
        os.close(inner)
        self.said = ""

    def read(self) -> None:
        """Take in what was said since."""
        if select.select([self._fd], [], [], 0.1)[0]:
            # It is an error to read once nobody holds the other end any more.
            with contextlib.suppress(OSError):
                self.said += os.read(self._fd, 65536).decode(errors="replace")

    def close(self) -> None:
        """End what still runs, and wait for it."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(DEADLINE)
        finally:
            self.process.kill()
            os.close(self._fd)


@pytest.fixture
def terminal(tmp_path: Path, display: str) -> Iterator[Terminal]:
    made = Terminal(tmp_path, display)
    yield made
    made.close()


def test_a_match_is_changed_in_the_window_and_played_in_the_terminal(
    terminal: Terminal, tmp_path: Path, display: str
) -> None:
    if shutil.which("xdotool") is None:
        missing("xdotool is not installed: nobody presses keys on the screen")

    def do(*words: str) -> str:
        done = subprocess.run(
            ["xdotool", *words], env={**os.environ, "DISPLAY": display}, capture_output=True, text=True, check=False
        )
        return done.stdout.strip()

    file, deadline = tmp_path / "final.toml", time.monotonic() + DEADLINE
    # Without a window manager the only window has the focus; until it is there, nothing has it.
    while do("getwindowfocus") in ("", "1"):
        terminal.read()
        assert time.monotonic() < deadline, terminal.said
    do("key", "c")
    do("type", "20.5")
    do("key", "Return", "ctrl+s")
    do("type", "final")
    do("key", "Return")
    while not file.exists():
        terminal.read()
        assert time.monotonic() < deadline, terminal.said
    assert load_match(file).players[0].pose.x == 20.5
    while "; run in runs/final-" not in terminal.said:
        do("key", "ctrl+p")
        terminal.read()
        assert time.monotonic() < deadline, terminal.said
    assert f"vrg play {file}" in terminal.said
