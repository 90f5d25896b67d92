"""Mixed matches in which robots have drives of these protocols."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.playing.test_mixed_in_process import MIXED, PHYSICAL, played
from tests.system.harness import Match, match_text
from tests.system.test_mixed import OTHER_GROUP, WIRING
from vrg.config.loading import load_match
from vrg.recording.reader import read_tracks


@pytest.mark.parametrize(
    "protocol", ["vesc", *(pytest.param(name, marks=pytest.mark.thorough) for name in ("cia402", "moteus"))]
)
def test_other_protocols_than_odrive_play_too(tmp_path: Path, protocol: str) -> None:
    text = MIXED.read_text().replace('protocol = "odrive"', f'protocol = "{protocol}"')
    text = text.replace("left = [0]", "left = [1]").replace("right = [1]", "right = [4]")
    if protocol == "vesc":
        text = text.replace("ratio = 50.0", "ratio = 50.0\noptions = { pole_pairs = 7 }")
    (tmp_path / "match.toml").write_text(text)
    _, tour, _ = played(tmp_path / "run", load_match(tmp_path / "match.toml", engine="planar", lasers=False), 15.0)
    assert tour.halts == {None}
    assert min(tour.ways[name] for name in PHYSICAL) > 0.5, tour.ways


@pytest.mark.system
@pytest.mark.thorough
def test_a_match_of_robots_of_two_protocols_and_virtual_ones_is_played_to_its_end(start: Callable[..., Match]) -> None:
    text = match_text(
        "mixed-short", length=13.0, width=9.0, zone=2.5, rules="pass_limit = 10.0", rate=2.0, wiring=WIRING
    ).replace("[backends.can.robots.bob]", f'[backends.can.robots.bob]\nprotocol = "moteus"\nchannel = "{OTHER_GROUP}"')
    match = start(text)
    assert "rate 1, not 2: ann, bob cannot be hurried" in match.said()
    assert match.play_out(physical=True) == 0
    result = json.loads(match.run.result.read_text())
    assert result["ended"] == "game over"
    assert match.run.plot.stat().st_size > 10_000
    tracks = read_tracks(match.run.recordings())
    assert {name: track.physical for name, track in tracks.items()} == {
        "shark": False, "ann": True, "bob": True, "cid": False,
    }  # fmt: skip
    for name in WIRING:
        assert np.ptp(tracks[name].y) > 2.0, f"{name} has hardly moved"
