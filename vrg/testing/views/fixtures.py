"""The keys and the recording of the made-up match, which a `conftest.py` imports; no display and no sound card then."""

import os
from pathlib import Path

import pytest

from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.recording.recorder import Recorder
from vrg.testing.views import synthetic

os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["SDL_AUDIODRIVER"] = "dummy"


@pytest.fixture
def keys() -> Keys:
    """The keys of a match."""
    return Keys("test")


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of both passes of the made-up match."""
    path = tmp_path_factory.mktemp("recording") / "match.mcap"
    keys = Keys("test")
    recorder = Recorder("recorder", Mailbox(), keys, path)
    match = synthetic.SyntheticMatch(keys)
    for tick in range(400):
        match.step(recorder, tick / 10, tick)
    recorder.stop()
    return path
