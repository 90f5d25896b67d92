"""The configurator's page, served on the loopback from an empty folder."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg.launch.endpoints import free_port
from vrg.testing.views.browser import browser
from vrg_edit.editor import Editor
from vrg_edit.server import HOST, EditServer

__all__ = ["browser"]


@pytest.fixture
def desk(tmp_path: Path) -> Editor:
    return Editor(tmp_path, tmp_path / "runs")


@pytest.fixture
def server(desk: Editor) -> Iterator[EditServer]:
    made = EditServer(desk, free_port(HOST, 18079, tries=200))
    made.start()
    yield made
    made.stop()
