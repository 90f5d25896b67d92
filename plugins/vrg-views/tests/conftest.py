"""What the tests of the views share: matches, windows, pages and the command line, of VRG's own tests."""

from pathlib import Path

import pytest

from tests.command_line import Vrg, command_line
from tests.system.conftest import arena, start
from tests.ui.conftest import keys, recorded
from tests.ui.web.conftest import browser, page_admission, port, server, visit

__all__ = ["arena", "browser", "keys", "page_admission", "port", "recorded", "server", "start", "visit"]


@pytest.fixture
def vrg(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Vrg:
    """Run the command line in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return command_line(monkeypatch, capsys)
