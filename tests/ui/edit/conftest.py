"""The configurator's page, served on the loopback from an empty folder."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from vrg.launch.endpoints import free_port
from vrg.playing.draft_check import DraftCheck
from vrg.playing.drafts import choices_in, recent_matches, save_draft
from vrg.ui.edit.editor import Editor, Tools
from vrg.ui.edit.server import HOST, EditServer


@pytest.fixture
def desk(tmp_path: Path) -> Editor:
    return Editor(
        Tools(DraftCheck(), save_draft, choices_in, lambda: recent_matches(tmp_path / "runs", tmp_path)), tmp_path
    )


@pytest.fixture
def server(desk: Editor) -> Iterator[EditServer]:
    made = EditServer(desk, free_port(HOST, 18079, tries=200))
    made.start()
    yield made
    made.stop()
