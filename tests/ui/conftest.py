"""No display, no sound card; scenes of the made-up match."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["SDL_AUDIODRIVER"] = "dummy"

from matplotlib.axes import Axes

from tests.ui import synthetic
from tests.ui.pictures import kept_axes
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.recording.recorder import Recorder
from vrg.ui.scene import Scene


@pytest.fixture
def keys() -> Keys:
    return Keys("test")


@pytest.fixture
def scene_at() -> Callable[..., Scene]:
    """Makes the scene at a time of the made-up match; fields of the referee's state can be replaced."""
    return synthetic.scene_at


@pytest.fixture
def drawn() -> Iterator[list[Axes]]:
    """The axes of each plot that is made."""
    with kept_axes() as kept:
        yield kept


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of both passes of the made-up match."""
    path = tmp_path_factory.mktemp("recording") / "match.mcap"
    keys = Keys("test")
    recorder = Recorder("recorder", Mailbox(), keys, path)
    match = synthetic.Match(keys)
    for tick in range(400):
        match.step(recorder, tick / 10, tick)
    recorder.stop()
    return path
