"""The match or the run that a command means, the list of the runs in a folder, and the files that commands write."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

import pytest

from vrg.commands.groups import MatchOptions
from vrg.commands.matches import attached, ended_run
from vrg.commands.options import write_text
from vrg.commands.runs.run import listed
from vrg.config.loading import load_match, match_path
from vrg.config.setup import write_setup
from vrg.errors import ConfigError, LaunchError
from vrg.launch.running import RunningMatch, registered
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke

GAME = match_path("sharks-and-minnows")


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)


def made(name: str, played: float, **result: object) -> Path:
    """A run folder of the default match; its result has these fields, if any."""
    run = Path("runs", name)
    run.mkdir(parents=True)
    text = GAME.read_text(encoding="utf-8")
    (run / "match.toml").write_text(text, encoding="utf-8")
    write_setup(load_match(run / "match.toml"), run / "setup.json")
    if result:
        (run / "result.json").write_text(json.dumps({"match": "m", "game": "sharks-and-minnows", **result}))
    os.utime(run / "match.toml", (played, played))
    return run


@contextmanager
def running(run: Path, name: str = "courtyard", port: int = 1) -> Iterator[None]:
    entry = RunningMatch(name, f"tcp/127.0.0.1:{port}", str(run.resolve()), os.getpid(), folder=str(Path.cwd()))
    with registered(entry):
        yield


@pytest.mark.parametrize("played", [1e400, -1.0, True, "long", 1e308])
def test_a_result_that_somebody_has_edited_takes_no_other_run_from_the_list(played: object) -> None:
    made("edited", 1e9, ended="game over", winner="sharks", play_time=played)
    made("good", 1.1e9, ended="game over", winner="sharks", play_time=75.4)
    found = invoke("run", "list").output
    assert "1:15" in found
    assert "result.json is damaged" in found


def test_a_link_to_nothing_in_the_place_of_the_runs_is_told(tmp_path: Path) -> None:
    Path("runs").symlink_to(tmp_path / "nothing")
    with pytest.raises(LaunchError, match="runs: the run folder cannot be made"):
        RunFolder.create(Path("runs"), "m", datetime(2026, 1, 1))


def test_a_file_that_nobody_has_named_is_written_in_the_place_of_a_link(tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    victim.write_text("mine")
    Path("tags.pdf").symlink_to(victim)
    write_text(Path("tags.pdf"), "tags", named=False)
    assert (victim.read_text(), Path("tags.pdf").read_text()) == ("mine", "tags")


def test_runs_are_listed_with_how_each_ended_the_newest_first() -> None:
    made("old", 1e9, ended="game over", winner="sharks", play_time=75.4)
    made("broken", 1.1e9, ended="interrupted", winner=None, play_time=3.0)
    made("killed", 1.2e9)
    going = made("going", 1.3e9)
    with running(going):
        found = {run.run: (run.ended.partition(":")[0], run.duration) for run in listed(Path("runs"))}
        done = invoke("run", "list", "--json")
    assert list(found.items()) == [
        ("going", ("still running", None)),
        ("killed", ("never ended", None)),
        ("broken", ("Interrupted", 3.0)),
        ("old", ("Sharks win", 75.4)),
    ]
    told = json.loads(done.stdout)
    assert [run["run"] for run in told] == list(found)
    assert datetime.fromisoformat(told[-1]["began"]).timestamp() == 1e9
    assert all(datetime.fromisoformat(run["began"]).tzinfo for run in told), "whoever reads it elsewhere knows when"
    assert "1:15" in invoke("run", "list").stdout


@pytest.mark.parametrize("torn", ["{", "[]", '{"game": 3}', '{"game": "x", "play_time": "y", "ended": "z"}', "\x00"])
def test_a_torn_result_is_told_as_far_as_it_goes(torn: str) -> None:
    run = made("torn", 1e9)
    (run / "result.json").write_text(torn)
    (run / "match.toml").write_text("game = [")
    Path("runs", "file").touch()
    Path("runs", "empty").mkdir()
    [only] = listed(Path("runs"))
    assert (only.run, only.ended.partition(":")[0]) == ("torn", "result.json is damaged")
    assert list(listed(Path("nowhere"))) == []


def test_the_newest_run_that_has_ended_is_meant_if_none_is_named() -> None:
    made("old", 1e9)
    newest = made("new", 1.1e9)
    going = made("going", 1.2e9)
    with running(going):
        assert ended_run(None)[0].path == newest
        assert ended_run(Path("old"))[0].path == Path("runs/old")
        with pytest.raises(LaunchError, match="still running"):
            ended_run(Path("going"))
    with pytest.raises(LaunchError, match=r"found none, did you mean 'old'\?"):
        ended_run(Path("olt"))


def test_where_the_only_run_still_runs_that_is_said() -> None:
    going = made("going", 1.2e9)
    with running(going), pytest.raises(LaunchError, match="going: this match is still running: close its window"):
        ended_run(None)


def test_a_replay_is_told_as_json_without_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    made("old", 1e9)
    done = invoke("run", "replay", "old", "--json")
    assert "expected a recording" in str(done.exception), "and no display"


def test_a_running_match_is_meant_by_name_file_game_or_run_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrg.launch.running._answers", lambda _: False)  # whatever else runs on this machine
    run = made("now", 1e9)
    name = load_match(GAME).name
    with running(run, name):
        for typed in (None, name, str(run), str(run / "match.toml"), "sharks-and-minnows"):
            found = attached(MatchOptions(typed))
            assert (found.name, found.endpoint, found.run) == (name, "tcp/127.0.0.1:1", run.resolve())
            assert len(found.known_setup().players) == 7
        with pytest.raises(ConfigError, match=f"did you mean '{name}'"):
            attached(MatchOptions(f"{name}s"))
    with pytest.raises(ConfigError, match="of this run has ended"):
        attached(MatchOptions(str(run)))


def test_a_match_elsewhere_is_known_by_its_file() -> None:
    found = attached(MatchOptions("sharks-and-minnows", "tcp/lab:7447"))
    assert (found.endpoint, found.run, len(found.known_setup().players)) == ("tcp/lab:7447", None, 7)
    with pytest.raises(ConfigError, match="type its match file"):
        attached(MatchOptions("final", "tcp/lab:7447")).known_setup()


def test_a_file_that_a_person_names_is_replaced_and_a_link_and_a_device_stay(tmp_path: Path) -> None:
    file, link = tmp_path / "sue.cal.toml", tmp_path / "link.toml"
    file.write_text("old")
    link.symlink_to(file)
    write_text(link, "new")
    assert (file.read_text(), link.is_symlink()) == ("new", True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.toml", "sue.cal.toml"]
    write_text(Path("/dev/null"), "as /dev/stdout")
    with pytest.raises(ConfigError, match="cannot be written: Not a directory: choose another place"):
        write_text(file / "below", "new text")
