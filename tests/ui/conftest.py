"""No display, no sound card; scenes of the made-up match."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

os.environ["SDL_VIDEODRIVER"] = "dummy"
os.environ["SDL_AUDIODRIVER"] = "dummy"

from tests.ui import synthetic
from vrg.bus import messages as m
from vrg.bus.mailbox import Mailbox
from vrg.bus.topics import Keys
from vrg.recording.recorder import Recorder
from vrg.ui.builder import SceneBuilder
from vrg.ui.scene import Scene


@pytest.fixture
def keys() -> Keys:
    return Keys("test")


@pytest.fixture
def scene_at() -> Callable[..., Scene]:
    """Makes the scene at a time of the made-up match; fields of the referee's state can be replaced."""

    def make(time: float, *, live: bool = True, estop: bool = False, **changes: object) -> Scene:
        builder = SceneBuilder(obstacles=synthetic.OBSTACLES)
        for tick in range(int(time * 10) + 1):
            builder.clock(m.Clock(time=tick / 10, tick=tick, epoch=0, rate=1.0, estop=estop))
            builder.poses(synthetic.poses(tick / 10), tick / 10)
        builder.referee(synthetic.state(time, **changes))
        for call in synthetic.calls(time):
            builder.call(call, call.clock)
        return builder.build(live)

    return make


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
