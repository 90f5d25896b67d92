"""A sensor of somebody else describes itself: it is recorded and listed, and VRG knows nothing of it."""

import io
import json
import math
from pathlib import Path

import pytest
from rich.console import Console

from tests.recording.recordings import messages_of
from vrg.bus import messages as m
from vrg.bus.codec import Received
from vrg.config.loading import load_match
from vrg.games import GAMES
from vrg.hal.sensors import message_class
from vrg.launch.nodes.recorder import recorder_node
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import play
from vrg.runs.run_folder import RunFolder
from vrg.ui.readings import Watched, sensor_table


def reading(heading: float) -> m.SensorMessage:
    message = message_class("compass")
    assert message is not None
    return message(heading=heading)


def test_it_is_recorded_in_a_match(installed: None, tmp_path: Path) -> None:
    setup, folder = load_match(GAMES.get("race").default_match()), RunFolder(tmp_path)
    play(setup, open_journal(setup, folder), watchers=[recorder_node(setup, folder)], limit=1.0)
    said = messages_of(folder.recording, topics="/robot/jade/sensor/compass/main")
    found = [(schema.name, json.loads(message.data)) for schema, _, message in said]
    assert len(found) >= 5
    assert {name for name, _ in found} == {"vrg.Compass"}
    assert found[0][1]["heading"] == pytest.approx(0.0, abs=0.1)


def test_it_is_listed_in_a_terminal(installed: None) -> None:
    watched, console = Watched(), Console(file=io.StringIO(), width=100)
    watched.take(("compass", "main"), Received("k", 1.0, 0, reading(math.pi / 2)))
    console.print(sensor_table(watched, "jade", 1.0))
    assert "90° from east" in console.file.getvalue()  # type: ignore[attr-defined]
