"""What a run folder keeps: everything to play the match again."""

import json
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from vrg import packages
from vrg.cli import main
from vrg.config.loading import load_match
from vrg.errors import LaunchError
from vrg.runs.keeping import files_of, keep
from vrg.runs.run_folder import RunFolder
from vrg.testing.command_line import invoke
from vrg.testing.processes.match import short_match

STRATEGY = """
import json

import kept_helper
from kept_talk.words import HELLO
from vrg.agents import Strategy, Twist


class Mine(Strategy):
    mode = kept_helper.MODE + HELLO

    def act(self, view):
        return Twist(v=0.0, w=0.0)
"""


@pytest.fixture
def match(tmp_path: Path) -> Path:
    """A match file that names files beside it, below it and elsewhere; strategies import what is beside them."""
    mine, other = tmp_path / "mine", tmp_path / "other"
    for folder in (mine, other):
        (folder / "kept_talk").mkdir(parents=True)
        (folder / "kept_talk" / "__init__.py").touch()
        (folder / "kept_talk" / "words.py").write_text(f"HELLO = '{folder.name}'\n")
        (folder / "kept_helper.py").write_text("MODE = 'helped '\n")
        (folder / "unused.py").touch()
        (folder / "kept_strategy.py").write_text(STRATEGY)
    (other / "yard.toml").write_text(
        'name = "yard"\nbounds = { x_min = -50.0, y_min = -50.0, x_max = 50.0, y_max = 50.0 }\n'
    )
    text = short_match("kept").replace('map = "open"', 'map = "../other/yard.toml"')
    for player, strategy in (
        ("ann", "kept_strategy.py:Mine"),
        ("bob", f"{other}/kept_strategy.py:Mine"),
        ("cid", "kept_strategy:Mine"),
    ):
        text = text.replace(f'name = "{player}"', f'name = "{player}"\nstrategy = "{strategy}"')
    (mine / "match.toml").write_text(text)
    return mine / "match.toml"


def test_every_file_and_what_it_imports_is_kept(match: Path) -> None:
    kept = files_of(load_match(match))
    beside = {"kept_strategy.py", "kept_helper.py", "kept_talk"}
    elsewhere = {f"files/1/{name}" for name in (*beside, "yard.toml")}
    assert {place.as_posix() for place in kept.copies} == beside | elsewhere
    assert "other" not in kept.text


def test_vrg_itself_is_not_kept_where_it_is_beside_a_strategy(match: Path) -> None:
    """As in a clone of VRG, in which a student plays."""
    (match.parent / "vrg").mkdir()
    (match.parent / "vrg" / "__init__.py").touch()
    assert not any(place.parts[0] == "vrg" for place in files_of(load_match(match)).copies)


def test_a_run_can_be_played_again_without_what_it_was_played_from(match: Path, tmp_path: Path) -> None:
    def play(file: Path, runs: str) -> Path:
        done = invoke("play", str(file), "--in-process", "--no-record", "--runs", str(tmp_path / runs))
        assert done.exit_code == 0, done.output
        return next((tmp_path / runs).iterdir())

    first = play(match, "first")
    shutil.rmtree(match.parent)
    shutil.rmtree(tmp_path / "other")
    again = play(first / "match.toml", "again")
    assert (again / "journal.jsonl").read_bytes() == (first / "journal.jsonl").read_bytes()
    setup = load_match(again / "match.toml")
    assert setup.player("bob").strategy == "files/1/kept_strategy.py:Mine"
    assert (again / "files" / "1" / "kept_talk" / "words.py").read_text() == "HELLO = 'other'\n"


def test_a_package_that_holds_the_runs_is_not_copied_into_itself(tmp_path: Path) -> None:
    team = tmp_path / "kept_team"
    team.mkdir()
    (team / "__init__.py").touch()
    (team / "player.py").write_text(
        "from vrg.games.sharks_and_minnows.player import SharksAndMinnowsPlayer as Player\n"
    )
    text = short_match("inside").replace('name = "ann"', 'name = "ann"\nstrategy = "kept_team.player:Player"')
    (tmp_path / "match.toml").write_text(text)
    for _ in range(3):
        done = invoke("play", str(tmp_path / "match.toml"), "--in-process", "--no-record", "--runs", str(team / "runs"))
        assert done.exit_code == 0, done.output
    for run in (team / "runs").iterdir():
        assert (run / "kept_team" / "player.py").is_file()
        assert not list((run / "kept_team").rglob("match.toml"))


def test_what_the_launcher_did_not_make_any_more_is_made_later(tmp_path: Path) -> None:
    (tmp_path / "match.toml").write_text(short_match("late"))
    played = invoke("play", str(tmp_path / "match.toml"), "--in-process", "--runs", str(tmp_path / "runs"))
    assert played.exit_code == 0, played.output
    run = next((tmp_path / "runs").iterdir())
    whole = json.loads((run / "result.json").read_text())
    (run / "result.json").unlink()
    (run / "trajectories.png").unlink()
    done = invoke("run", "result", str(run))
    assert done.exit_code == 0
    assert " win: " in done.output
    assert json.loads((run / "result.json").read_text()) == whole
    assert invoke("run", "plot", str(run)).exit_code == 0
    assert (run / "trajectories.png").stat().st_size > 10_000

    lines = (run / "journal.jsonl").read_text().splitlines(keepends=True)
    (run / "journal.jsonl").write_text("".join(lines[:2]))
    (run / "result.json").unlink()
    done = invoke("run", "result", str(run))
    assert "Broken off: `vrg play` ended before the match" in done.output

    (run / "result.json").write_text(json.dumps({**whole, "ended": "interrupted"}))
    assert "Interrupted" in invoke("run", "result", str(run)).output
    assert json.loads((run / "result.json").read_text())["ended"] == "interrupted", "the journal does not tell why"


def test_a_match_is_played_without_matplotlib_and_says_what_a_plot_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(packages, "find_spec", lambda module: None if module == "matplotlib" else find_spec(module))
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.delitem(sys.modules, "vrg.ui.plots.plot", raising=False)
    (tmp_path / "match.toml").write_text(short_match("plain"))
    played = invoke("play", str(tmp_path / "match.toml"), "--in-process", "--runs", str(tmp_path / "runs"))
    assert played.exit_code == 0, played.output
    needed = "the package matplotlib is not installed, and this needs it: pip install 'virtual-robotic-games[plots]'"
    assert f"no plot of the trajectories: {needed}" in " ".join(played.output.split())
    run = next((tmp_path / "runs").iterdir())
    assert (run / "result.json").is_file()
    assert not (run / "trajectories.png").exists()
    monkeypatch.setattr(sys, "argv", ["vrg", "run", "plot", str(run)])
    with pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().err == f"vrg: {needed}\n"


@pytest.mark.parametrize("command", ["result", "plot"])
def test_what_is_no_run_folder_is_told(tmp_path: Path, command: str) -> None:
    done = invoke("run", command, str(tmp_path))
    assert isinstance(done.exception, LaunchError)
    assert "expected a run folder with a setup.json" in str(done.exception)


def test_the_match_file_is_written_also_where_a_file_cannot_be_copied(match: Path, tmp_path: Path) -> None:
    setup, folder = load_match(match), RunFolder(tmp_path / "run")
    folder.prepare()
    (folder.path / "files").touch()
    with pytest.raises(OSError, match="files"):
        keep(setup, folder)
    assert folder.match_file.read_text() == match.read_text()
