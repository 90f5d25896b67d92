"""Plain `vrg` on a screen: a person changes a match by keys, saves it, and it is played in the same terminal."""

import os
import pty
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.requirements import missing
from tests.system.conftest import Screen
from vrg.config.loading import load_match

pytestmark = pytest.mark.system


class Terminal:
    """A terminal in which `vrg` was typed."""

    def __init__(self, fd: int, process: "subprocess.Popen[bytes]") -> None:
        self._fd = fd
        self.process = process
        self.said = ""

    def wait_for(self, words: str, seconds: float = 60.0) -> None:
        """Read until these words were said."""
        deadline = time.monotonic() + seconds
        while words not in self.said:
            assert time.monotonic() < deadline, self.said
            if select.select([self._fd], [], [], 0.2)[0]:
                try:
                    self.said += os.read(self._fd, 65536).decode(errors="replace")
                except OSError:
                    # Nobody holds the other end any more.
                    assert words in self.said, self.said
