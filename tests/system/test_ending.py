"""How a match ends: by its rules, by its user, by an accident. No process is ever left behind."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.system.conftest import STUCK_ONCE
from vrg.bus.messages import Stage
from vrg.coordinator.journal import read_journal
from vrg.recording.reader import calls_of, read_tracks
from vrg.recording.recorded import read_recorded
from vrg.testing.processes.match import PLAYERS, LiveMatch, long_match, short_match
from vrg.testing.waiting import wait_until

pytestmark = pytest.mark.system


def test_a_short_match_is_played_to_its_end(start: Callable[..., LiveMatch]) -> None:
    match = start(short_match("short", pass_limit=12.0, rate=3.0))
    assert match.play_out() == 0
    said, run = match.said(), match.run
    assert "killed" not in said
    assert "started again" not in said
    assert "NO CLOCK" not in said.split("game over")[-1], "the launcher does not watch its own end"
    assert "Recorded in" in said

    result = json.loads(run.result.read_text())
    assert result["ended"] == "game over"
    assert result["winner"] in ("sharks", "minnows")
    assert f"{result['winner'].capitalize()} win" in said
    header, records = read_journal(run.journal)
    assert header.match == "short"
    assert records[-1].standing.stage is Stage.GAME_OVER
    assert records[-1].standing.winner == result["winner"]
    calls = [call for record in records for call in record.calls]
    assert [call.number for call in calls] == list(range(1, len(calls) + 1))
    assert [(c["rule"], c["text"]) for c in result["calls"]] == [(c.rule, c.text) for c in calls]

    tracks = read_tracks(run.recording)
    assert set(tracks) == set(PLAYERS)
    assert all(len(track.times) > 50 for track in tracks.values())
    assert [call.number for call in calls_of(read_recorded(run.recording))] == [call.number for call in calls]
    assert run.plot.read_bytes().startswith(b"\x89PNG")
    assert f"{len(calls)} calls were judged again" in match.command("run", "judge", str(run.path))
    for name in ("router", "world", "referee", "recorder", *PLAYERS):
        log = match.log(name)
        assert "stopped by SIGTERM" in log, name
        assert "Traceback" not in log, log
    for name in ("world", "referee", "recorder", *PLAYERS):
        statistics = json.loads((run.logs / f"{name}.json").read_text())
        assert statistics["ticks"] > 50
        assert statistics["dropped"] == 0
    assert not list((run.path).glob(".*")), "no half-written file is left"


@pytest.mark.thorough
def test_nobody_outlives_a_launcher_that_is_killed(start: Callable[..., LiveMatch], tmp_path: Path) -> None:
    """Not even a player in an endless loop, which never looks whether it should stop."""
    (tmp_path / "stuck.py").write_text(STUCK_ONCE)
    strategy = f'name = "bob"\nstrategy = "{tmp_path}/stuck.py:Stuck"'
    match = start("sandbox = false\n" + long_match("orphans").replace('name = "bob"', strategy))
    assert len(match.survivors()) == 10, "the launcher, its fork server and eight nodes"
    (tmp_path / "hang").touch()
    wait_until((tmp_path / "was_stuck").exists, "bob to be stuck")
    match.launcher.kill()
    wait_until(lambda: not match.survivors(), "every process to end by itself")
    for name in ("world", "referee", "recorder", *set(PLAYERS) - {"bob"}):
        assert "stopping: the supervisor is gone" in match.log(name), name
    assert set(read_tracks(match.run.recording)) == set(PLAYERS)
    read_journal(match.run.journal)
