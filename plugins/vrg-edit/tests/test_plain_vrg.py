"""`vrg` alone in a terminal without a display: the page that it serves."""

import contextlib
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from vrg.config.loading import load_match
from vrg.testing.waiting import DEADLINE

pytestmark = pytest.mark.system


class Terminal:
    """A terminal in which plain `vrg` was typed, and what it has said."""

    def __init__(self, folder: Path) -> None:
        gone = ("DISPLAY", "WAYLAND_DISPLAY")
        environment = {name: value for name, value in os.environ.items() if name not in gone}
        environment |= {"PYTHONPATH": str(Path(__file__).parents[3]), "COLUMNS": "300"}
        self._fd, inner = pty.openpty()
        command = [sys.executable, "-P", "-m", "vrg"]
        self.process = subprocess.Popen(
            command, stdin=inner, stdout=inner, stderr=inner, cwd=folder, env=environment, start_new_session=True
        )
        os.close(inner)
        self.said = ""

    def until(self, pattern: str) -> str:
        """Wait until something was said, and return the group of the pattern."""
        deadline = time.monotonic() + DEADLINE
        while (found := re.search(pattern, self.said)) is None:
            assert time.monotonic() < deadline, self.said
            self._read()
        return found[1]

    def _read(self) -> None:
        """Take in what was said since."""
        if select.select([self._fd], [], [], 0.1)[0]:
            # It is an error to read once nobody holds the other end any more.
            with contextlib.suppress(OSError):
                self.said += os.read(self._fd, 65536).decode(errors="replace")

    def close(self) -> None:
        """End what still runs, and wait for it."""
        deadline = time.monotonic() + DEADLINE
        try:
            while self.process.poll() is None:
                assert time.monotonic() < deadline, "it did not end by Ctrl-C"
                # Between a prompt and its reading Ctrl-C is not seen before a key is: people press again.
                self.process.send_signal(signal.SIGINT)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self.process.wait(1.0)
        finally:
            self.process.kill()
            os.close(self._fd)


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    made = Terminal(tmp_path)
    yield made
    made.close()


class Page:
    """Asks the page's server as the page does."""

    def __init__(self, link: str) -> None:
        self._address, _, self._token = link.partition("#")
        self.told = self.ask(do="look")

    def ask(self, **request: object) -> dict[str, Any]:
        headers = {"Authorization": f"Bearer {self._token}"}
        asked = urllib.request.Request(f"{self._address}edit", json.dumps(request).encode(), headers)
        with urllib.request.urlopen(asked, timeout=DEADLINE) as answer:
            self.told = json.loads(answer.read())
        return self.told


def test_a_match_is_changed_on_the_page_and_played_in_the_terminal(terminal: Terminal, tmp_path: Path) -> None:
    page = Page(terminal.until(r"open this page in a browser: (\S+)"))
    page.ask(do="set", key="players.0.x", typed="20.5", seen=page.told["number"])
    page.ask(do="save", name="final", play=True, seen=page.told["number"])
    assert page.told["ended"], page.told["notice"]
    assert load_match(tmp_path / "final.toml").players[0].pose.x == 20.5
    terminal.until(f"vrg play {re.escape(str(tmp_path / 'final.toml'))}()")
    terminal.until("(; run in runs/final-)")
