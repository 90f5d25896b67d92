"""The commands `vrg compare` and `vrg tournament`: what they print, write and refuse."""

import html
import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import psutil
import pyarrow as pa
import pytest
from experiments import OWN, alive, target
from pyarrow import csv, parquet

from vrg.testing.command_line import Vrg, tells_of_missing
from vrg.testing.waiting import wait_until
from vrg_league.files import write

LONG = ("--no-lasers", "--games", "40", "--all", "--jobs", "2", "--output", "long")
PATIENCE = 180.0
"""The real time in s that something may take to happen."""


def test_a_comparison_prints_and_writes_what_it_has_found(vrg: Vrg, tmp_path: Path) -> None:
    command = ("compare", "sharks-and-minnows", "players.py:Lazy", "--match", "tiny.toml", "--no-sandbox")
    command = (*command, "--confidence", "0.5")
    done = vrg(*command, "--output", "here")
    assert done.status == 0
    assert "sharks-and-minnows beats Lazy: 100 % of 8 games, 50 % interval 58 to 100 %" in done.out
    assert "on Lazy" in done.out
    out = tmp_path / "here"
    written = {path.name for path in out.iterdir() if path.is_file()}
    assert written == {
        "experiment.json", "games.jsonl", "games.csv", "games.parquet", "report.md", "comparison.png",
    }  # fmt: skip
    assert not (out / "playing").exists()
    table = parquet.read_table(out / "games.parquet")
    assert table.num_rows == csv.read_csv(out / "games.csv").num_rows == 8
    row = table.to_pylist()[1]
    assert (row["seed"], row["first_team"], row["winner"], row["first_points"]) == (
        0, "minnows", "sharks-and-minnows", 1.0,
    )  # fmt: skip
    assert row["calls_begin"] == 1
    assert row["play_again"] == "vrg play here/matches/Lazy.vs.sharks-and-minnows/match.toml --in-process --seed 0"
    assert "beats Lazy" in (out / "report.md").read_text()
    again = vrg(*command, "--output", "here")
    assert "games are in here already" in again.out
    assert "games played" not in again.out
    assert again.out.splitlines()[-1] == done.out.splitlines()[-1]
    (out / "comparison.png").unlink()
    (out / "comparison.png").mkdir()
    failed = vrg(*command, "--output", "here")
    assert failed.status == 1
    assert "here: comparison.png cannot be written: Is a directory" in failed.err


def test_a_tournament_prints_and_writes_a_cross_table_and_ratings(vrg: Vrg, tmp_path: Path) -> None:
    command = ("tournament", "players.py:Lazy", "sharks-and-minnows", "--match", "tiny.toml", "--games", "2")
    done = vrg(*command, "--mirror", "--no-sandbox", "--output", "here")
    assert done.status == 0
    assert "1. sharks-and-minnows, 2. Lazy" in done.out
    pairings = parquet.read_table(tmp_path / "here" / "pairings.parquet").to_pylist()
    assert len(pairings) == 3
    assert next(p for p in pairings if p["first"] == p["second"] == "Lazy")["share_of_first"] == 0.5
    ratings = parquet.read_table(tmp_path / "here" / "ratings.parquet").to_pylist()
    assert [row["strategy"] for row in ratings] == ["sharks-and-minnows", "Lazy"]
    assert ratings[0]["rating"] > 1500.0 > ratings[-1]["rating"]
    assert parquet.read_table(tmp_path / "here" / "games.parquet").num_rows == 6
    assert (tmp_path / "here" / "tournament.png").stat().st_size > 10_000
    assert "| sharks-and-minnows |" in (tmp_path / "here" / "report.md").read_text()


def test_a_folder_of_files_plays_and_what_cannot_play_is_left_out(vrg: Vrg, tmp_path: Path) -> None:
    (tmp_path / "class").mkdir()
    for name, code in (
        ("Anna Maria", f"{OWN}return STILL\n"),
        ("cem", f"{OWN}raise ValueError('no idea')\n"),
        ("dora", f"{OWN}return STILL)\n"),
        ("eve", "from vrg.agents import Strategy\n\n\nclass Mine(Strategy):\n    pass\n"),
        ("fay", f"x = {'1+' * 100_000}1\n"),
        ("gül" * 40, f"{OWN}return STILL\n"),
        ("_notes", "what is this?\n"),
    ):
        (tmp_path / "class" / f"{name}.py").write_text(code)
    (tmp_path / "class" / "old.py").mkdir()
    os.mkfifo(tmp_path / "class" / "pipe.py")
    (tmp_path / "class" / os.fsdecode(b"\xe9ve.py")).write_text(f"{OWN}return STILL\n")
    (tmp_path / "class" / "z\x1b[31mz.py").write_text("what\n")
    done = vrg("tournament", "class", "--match", "tiny.toml", "--games", "2", "--output", "a cup")
    assert done.status == 0
    assert "left out: cem: " in done.out
    assert "ValueError: no idea (cem.py, line 6, in act)" in done.out
    assert (
        "left out: dora: class/dora.py: cannot be read as Python: SyntaxError: unmatched ')' (dora.py, line 6)"
        in done.out
    )
    assert "left out: eve: class/eve.py: expected one class with a method `act`, found none" in done.out
    assert "left out: fay: class/fay.py: cannot be read as Python: " in done.out
    for name in ("old", "pipe"):
        assert f"left out: {name}: {name}.py: expected a file, found none: put the file itself there" in done.out
    assert "left out: \\udce9ve: its name is not in UTF-8" in done.out
    assert "left out: z\\x1b[31mz: class/z\\x1b[31mz.py: " in done.out
    assert "at most 2 games of 1 pairing" in done.out
    assert "vrg play 'a cup/matches/" in done.out
    board = html.unescape((tmp_path / "a cup" / "leaderboard.html").read_text())
    assert "<td>Anna Maria</td>" in board
    assert "left out: dora, eve, fay, old, pipe, z\\x1b[31mz, \\udce9ve, cem" in board
    assert "refresh" not in board
    assert f"| Anna Maria | {'gül' * 15} | 2 | 0 |" in (tmp_path / "a cup" / "schedule.md").read_text()


@pytest.mark.parametrize("options", [(), ("--no-sandbox",)], ids=["sealed", "in one process"])
def test_an_entry_of_a_folder_sees_its_own_files_alone(vrg: Vrg, tmp_path: Path, options: Sequence[str]) -> None:
    (tmp_path / "class" / "cem").mkdir(parents=True)
    for name, code in (
        ("bob", f"{OWN}return STILL\n"),
        ("ann", "from bob import Mine as His\n\n\nclass Mine(His): ...\n"),
        ("dora", f"{OWN}from bob import Mine\n        return STILL\n"),
        ("eve", f"from cem.ideas import SPEED\n{OWN}return STILL\n"),
        ("cem/cem", f"from ideas import SPEED\n{OWN}return Twist(SPEED, 0.0)\n"),
        ("cem/ideas", "SPEED = 0.5\n"),
    ):
        (tmp_path / "class" / f"{name}.py").write_text(code)
    done = vrg("tournament", "class", "--match", "tiny.toml", "--games", "2", "--output", "cup", *options)
    assert done.status == 0, done.out
    assert "left out: ann: " in done.out
    assert "ModuleNotFoundError: No module named 'bob' (ann.py, line 1" in done.out
    assert "ModuleNotFoundError: No module named 'bob' (dora.py, line 6, in act)" in done.out
    assert "ModuleNotFoundError: No module named 'cem' (eve.py, line 1" in done.out
    assert "at most 2 games of 1 pairing" in done.out
    [match] = (tmp_path / "cup" / "matches").glob("bob.vs.cem")
    assert {file.name for file in match.rglob("*.py")} == {"bob.py", "cem.py", "ideas.py"}
    (tmp_path / "class" / "cem" / "ideas.py").write_text("SPEED = 0.6\n")
    refused = vrg("tournament", "class", "--match", "tiny.toml", "--games", "2", "--output", "cup", *options)
    assert refused.status == 1
    assert "cem of cem has changed" in refused.err


def test_the_files_of_a_folder_do_not_run_unsealed_unless_that_is_asked_for(
    vrg: Vrg, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "class").mkdir()
    mark = tmp_path / "it ran"
    for name in ("ann", "ben"):
        code = f"from pathlib import Path\n\nPath({str(mark)!r}).touch()\n{OWN}return STILL\n"
        (tmp_path / "class" / f"{name}.py").write_text(code)
    monkeypatch.setattr("vrg.launch.sandbox.seal.missing", lambda: "no Landlock here")
    command = ("tournament", "class", "--match", "tiny.toml", "--games", "2", "--output", "cup")
    done = vrg(*command)
    assert done.status == 1
    assert "no Landlock here; --no-sandbox lets the files of a folder play anyway" in done.err
    assert not mark.exists()
    assert vrg(*command, "--no-sandbox").status == 0
    assert mark.exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("compare", "empty", "players.py:Lazy"),
            "got the folder empty: `vrg tournament empty` lets all files in it play",
        ),
        (("tournament", "empty"), "expected two or more different strategies, found 0 in empty"),
        (("tournament", "nowhere", "players.py:Lazy"), "nowhere: strategy: expected one of"),
        (("compare", "players.py", "players.py:Lazy"), "players.py: expected one class with a method `act`, found "),
        (("tournament", "players.py:Lazy", "players.py:Lazy"), "found 1 in players.py:Lazy players.py:Lazy"),
        (("compare", "sharks-and-minnows", "players.py:Nobody"), "expected the name of a class"),
        (("compare", "sharks-and-minnows", "nowhere.py:Mine"), "nowhere.py:Mine: no such file"),
    ],
)
def test_a_strategy_that_is_not_there_is_told_before_a_game_is_played(
    vrg: Vrg, tmp_path: Path, arguments: Sequence[str], said: str
) -> None:
    (tmp_path / "empty").mkdir()
    done = vrg(*arguments, "--match", "tiny.toml", "--output", "here")
    assert done.status == 1
    assert done.err.count(said) == 1
    assert not (tmp_path / "here").exists()


def test_a_strategy_that_is_misspelled_comes_with_the_one_that_is_meant(vrg: Vrg) -> None:
    done = vrg("compare", "balancd", "conservative", "--match", "roboflag", "--games", "1")
    assert done.status == 1
    assert "did you mean 'balanced'?" in " ".join(done.err.split())


def test_without_pyarrow_a_comparison_tells_what_installs_it() -> None:
    tells_of_missing("pyarrow", ["compare", "none", "none", "--match", "roboflag"])


def started(match: Path, *more: str, group: bool = False) -> subprocess.Popen[str]:
    """A comparison that takes long, once a game has been played."""
    words = ["compare", "sharks-and-minnows", target(match, "Ahead"), "--match", "sharks-and-minnows", *LONG, *more]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "vrg", *words], cwd=match.parent, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, start_new_session=group,
    )  # fmt: skip
    record = match.parent / "long" / "games.jsonl"
    before = record.stat().st_size if record.exists() else 0
    wait_until(lambda: process.poll() is not None or (record.exists() and record.stat().st_size > before), "a game")
    assert process.poll() is None, f"it ended with status {process.returncode}: {process.communicate()[0]}"
    return process


@pytest.mark.thorough
@pytest.mark.system
def test_ctrl_c_ends_a_comparison_with_what_is_there(match: Path) -> None:
    process = started(match)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "Traceback" not in out
    assert "Written to long" in out


@pytest.mark.thorough
@pytest.mark.system
def test_a_signal_to_all_its_processes_counts_no_game_that_was_being_played(match: Path) -> None:
    """As a service manager sends it, or `kill` to a group."""
    process = started(match, group=True)
    os.killpg(process.pid, signal.SIGTERM)
    process.communicate(timeout=PATIENCE)
    rows = [json.loads(line) for line in (match.parent / "long" / "games.jsonl").read_text().splitlines()]
    assert {row["played"]["ended"] for row in rows} == {"game over"}


@pytest.mark.thorough
@pytest.mark.system
def test_a_comparison_that_is_killed_leaves_no_process_behind_and_goes_on(match: Path) -> None:
    process = started(match)
    children = psutil.Process(process.pid).children(recursive=True)
    assert len(children) >= 3
    process.kill()
    process.communicate(timeout=PATIENCE)
    wait_until(lambda: not alive(children), "its processes to end")
    played = len((match.parent / "long" / "games.jsonl").read_text().splitlines())
    process = started(match)
    process.send_signal(signal.SIGTERM)
    out, _ = process.communicate(timeout=PATIENCE)
    assert f"{played} games are in long already" in out


def test_what_is_not_known_and_what_is_no_number_are_two_things_in_both_files(tmp_path: Path) -> None:
    columns = {"share": (pa.float64(), [0.5, None, math.nan]), "problem": (pa.string(), ["a, b", None, ""])}
    write(tmp_path, "games", columns)
    assert (tmp_path / "games.csv").read_text() == '"share","problem"\n0.5,"a, b"\n,\nnan,""\n'
    share, problem = (column.to_pylist() for column in parquet.read_table(tmp_path / "games.parquet"))
    assert share[:2] == [0.5, None]
    assert math.isnan(share[2])
    assert problem == ["a, b", None, ""]
