"""Mixed matches in which robots have drives of these protocols."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from vrg.config.loading import load_match
from vrg.recording.reader import read_tracks
from vrg.testing import matches
from vrg.testing.processes.match import LiveMatch, match_text

MIXED = Path(__file__).parents[3] / "examples" / "mixed.toml"
PHYSICAL = ("player2", "player5")
WIRING = {"ann": (0, 1), "bob": (2, 3)}
OTHER_GROUP = "239.74.163.9"
"""The bus of robots that speak another protocol: two protocols cannot share one."""


@pytest.mark.parametrize(
    "protocol", ["vesc", *(pytest.param(name, marks=pytest.mark.thorough) for name in ("cia402", "moteus"))]
)
def test_other_protocols_than_odrive_play_too(tmp_path: Path, protocol: str) -> None:
    text = MIXED.read_text().replace('protocol = "odrive"', f'protocol = "{protocol}"')
    text = text.replace("left = [0]", "left = [1]").replace("right = [1]", "right = [4]")
    if protocol == "vesc":
        text = text.replace("ratio = 50.0", "ratio = 50.0\noptions = { pole_pairs = 7 }")
    (tmp_path / "match.toml").write_text(text)
    setup = load_match(tmp_path / "match.toml", engine="planar", lasers=False).at_rate(0.0)
    ending, run = matches.played(setup, tmp_path / "run", recorded=True, limit=15.0)
    assert ending.state.halted is None
    assert not matches.calls_of(run, "halt")
    tracks = read_tracks(run.recordings())
    ways = {name: np.abs(np.diff([tracks[name].x, tracks[name].y])).sum() for name in PHYSICAL}
    assert min(ways.values()) > 0.5, ways


@pytest.mark.system
@pytest.mark.thorough
def test_a_match_of_robots_of_two_protocols_and_virtual_ones_is_played_to_its_end(
    start: Callable[..., LiveMatch],
) -> None:
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
