"""What the tests of the recording share."""

import pytest

from tests.recording.recordings import record


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "match.mcap"
    record(path, 40.0).stop()
    return path
