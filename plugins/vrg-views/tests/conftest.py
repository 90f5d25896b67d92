"""What the tests of the views share: matches, windows, pages and the command line."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg.testing.command_line import Vrg, command_line
from vrg.testing.installing import installed
from vrg.testing.processes.arena import arena, start
from vrg.testing.views.browser import browser
from vrg.testing.views.fixtures import keys, recorded
from vrg.testing.views.page import page_admission, port, server, visit

__all__ = ["arena", "browser", "keys", "page_admission", "port", "recorded", "server", "start", "visit"]


@pytest.fixture
def needle() -> Iterator[None]:
    """A package with a sensor and a robot that carries it is installed."""
    with installed(Path(__file__).with_name("needle")):
        yield


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Vrg:
    """Run the command line in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return command_line(monkeypatch, capsys)
