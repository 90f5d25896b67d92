"""What the tests of the recording share."""

import pytest

from tests.recording.recordings import KEYS, record
from vrg.bus.mailbox import Mailbox
from vrg.recording.recorder import Recorder


@pytest.fixture
def path(tmp_path):
    return tmp_path / "match.mcap"


@pytest.fixture
def recorder(path):
    """One that has heard nothing."""
    return Recorder("recorder", Mailbox(), KEYS, path)


@pytest.fixture
def file(path):
    """The recording of the whole made-up match."""
    record(path, 40.0).stop()
    return path
