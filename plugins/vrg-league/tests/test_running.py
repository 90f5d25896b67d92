"""Comparisons that are played: what they depend on and record, how they go on, and that games can be played again."""

import json
import sys
import threading
from pathlib import Path

import pytest
from experiments import OWN, Play, definition, experiment, target, timeless

from vrg.cli import main
from vrg.config.loading import load_match
from vrg.errors import ConfigError, LaunchError
from vrg_league.comparison import Comparison
from vrg_league.contenders import contenders, unable
from vrg_league.experiment import define, written
from vrg_league.folder import ExperimentFolder
from vrg_league.games import BROKEN_OFF, OVER, GameRecord
from vrg_league.playing import counted
from vrg_league.workers import Workers


def test_each_seed_is_played_twice_with_the_sides_swapped(play: Play) -> None:
    rows = play("sharks-and-minnows", "Lazy", seed=7)
    assert [(row.game.seed, row.game.first_team, row.game.second_team) for row in rows] == [
        (7, "sharks", "minnows"),
        (7, "minnows", "sharks"),
        (8, "sharks", "minnows"),
        (8, "minnows", "sharks"),
    ]
    assert {row.played.ended for row in rows} == {OVER}
    # Minnows that stand still are caught, and a shark that stands still lets a minnow get away.
    assert [row.points for row in rows] == [1.0] * 4
    assert {row.winner for row in rows} == {"sharks-and-minnows"}


def test_games_at_the_same_time_change_no_result(play: Play) -> None:
    """Not even of a strategy whose module remembers what was played before."""
    one = play("Remembers", "Ahead", "one", pairs=1, jobs=1)
    assert timeless(one) == timeless(play("Remembers", "Ahead", "two", pairs=1, jobs=2))
    assert {row.played.ended for row in one} == {OVER}


def test_what_a_minute_of_a_game_takes_is_known_before_the_first_one(match: Path) -> None:
    stop = threading.Event()
    with experiment(match, "sharks-and-minnows", "Ahead", "out", pairs=1, seed=0) as found:
        workers = Workers(1, found.folder, found.setup)
        with workers:
            minute = workers.minute(found.setup, stop)
            assert minute is not None
            assert minute > 0.0
            stop.set()
            assert workers.minute(found.setup, stop) is None
        assert not workers.games()
        assert found.completed == 0  # nothing of it counts


def test_an_interrupted_comparison_goes_on_where_it_stopped(play: Play, tmp_path: Path) -> None:
    whole = timeless(play("sharks-and-minnows", "Ahead", "whole", pairs=1))
    stop = threading.Event()
    interrupted = play("sharks-and-minnows", "Ahead", pairs=1, jobs=1, stop=stop, told=lambda _: stop.set())
    assert len(interrupted) == 0  # one game is no pair
    record = tmp_path / "out" / "games.jsonl"
    with record.open("a") as file:
        file.write('{"game": {"pai')  # a line that was torn
    told: list[GameRecord] = []
    assert timeless(play("sharks-and-minnows", "Ahead", pairs=1, told=told.append)) == whole
    assert len(told) == 1
    again: list[GameRecord] = []
    assert timeless(play("sharks-and-minnows", "Ahead", pairs=1, told=again.append)) == whole
    assert again == []
    assert len(record.read_text().splitlines()) == 2


def test_what_fails_is_visible_and_counts(play: Play, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    rows = play("Raises", "Ahead", pairs=1, sealed=True)
    assert {row.played.ended for row in rows} == {OVER}
    assert {name for row in rows for name in row.played.disqualified} == {"shark", "ann", "bob"}
    assert all("ValueError: no idea (players.py" in row.played.failures[0] for row in rows)
    log = tmp_path / "out" / "failures" / "Raises.vs.Ahead-0" / "logs" / "shark.log"
    assert 'raise ValueError("no idea")' in log.read_text()
    assert capfd.readouterr() == ("", "")


def test_a_strategy_that_ends_its_process_loses_and_its_game_goes_on(play: Play) -> None:
    rows = play("Dies", "Ahead", pairs=1, sealed=True)
    assert [row.played.ended for row in rows] == [OVER, OVER]
    assert [row.points for row in rows] == [0.0, 0.0]
    assert "the process of the strategy is gone" in rows[0].played.failures[0]


def test_a_game_that_takes_too_long_is_a_draw(play: Play) -> None:
    rows = play("sharks-and-minnows", "Lazy", pairs=1, limit=2.0)
    assert [row.played.ended for row in rows] == [BROKEN_OFF, BROKEN_OFF]
    assert [row.points for row in rows] == [0.5, 0.5]


def test_every_game_can_be_played_again(play: Play, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    row = play("Ahead", "sharks-and-minnows", pairs=1, seed=5)[1]
    with ExperimentFolder(
        tmp_path / "out", definition(tmp_path / "tiny.toml", 5, "Ahead", "sharks-and-minnows")
    ) as folder:
        command = folder.again(row.game)
    assert command.endswith("sharks-and-minnows.vs.Ahead/match.toml --in-process --seed 5")
    (tmp_path / "players.py").unlink()  # what was played is in the folder
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [*command.split(), "--headless", "--no-record"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    [result] = (tmp_path / "runs").glob("*/result.json")
    found = json.loads(result.read_text())
    assert (found["winner"], found["score"]) == (row.played.winner, row.played.score)
    assert found["play_time"] == row.played.play_time
    rules = [call["rule"] for call in found["calls"]]
    assert {rule: rules.count(rule) for rule in rules} == {rule: row.total(rule) for rule in row.played.calls}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("seed", "the seed is 1 now and was 0"),
        ("names", "the strategies are "),
        ("match", "the match file or an option"),
        ("code", "players.py of Ahead has changed"),
    ],
)
def test_a_folder_is_not_shared_by_two_experiments(match: Path, change: str, said: str) -> None:
    ExperimentFolder(match.parent / "out", definition(match, 0, "Lazy", "Ahead")).close()
    if change == "match":
        match.write_text(match.read_text() + "camera = true\n")
    if change == "code":
        (match.parent / "players.py").write_text("class Lazy: ...\nclass Ahead: ...\n")
    names = ("Lazy", "Raises") if change == "names" else ("Lazy", "Ahead")
    other = definition(match, 1 if change == "seed" else 0, *names)
    with pytest.raises(ConfigError, match=said):
        ExperimentFolder(match.parent / "out", other)


def test_a_comparison_without_games_is_undecided_and_has_nothing_to_plot(match: Path) -> None:
    with experiment(match, "Lazy", "Ahead", "out", pairs=1, seed=0) as running:
        found = Comparison(running, 0.95)
        found.write()
    assert (found.result, found.rate, found.interval) == ("undecided", None, (0.0, 1.0))
    assert found.to_arrow().num_rows == 0
    assert "<img" not in found._repr_html_()
    assert found.sentence in (found.path / "report.md").read_text()
    with pytest.raises(LaunchError, match="expected games to plot, found none"):
        found.plot()


def test_a_folder_with_other_files_is_refused(match: Path) -> None:
    with pytest.raises(ConfigError, match="found other files: choose another --output"):
        ExperimentFolder(match.parent, definition(match, 0, "Lazy", "Ahead"))


def test_two_processes_cannot_use_one_folder(match: Path) -> None:
    some = definition(match, 0, "Lazy", "Ahead")
    with (
        ExperimentFolder(match.parent / "out", some),
        pytest.raises(LaunchError, match="another process plays these games"),
    ):
        ExperimentFolder(match.parent / "out", some)


def test_strategies_that_cannot_play_are_named_with_the_reason(match: Path) -> None:
    loop = "import time\nwhile True:\n    time.sleep(1.0)\n"
    for name, text in {"broken": "import no_such_module\n", "loops": loop}.items():
        (match.parent / f"{name}.py").write_text(text)
    own = [f"{match.parent / name}.py:Mine" for name in ("broken", "loops")]
    found = contenders([*own, *(target(match, name) for name in ("Lazy", "Raises", "Dies", "Ahead"))])
    # The others may take as long as this computer needs.
    problems = unable(load_match(match), [found[0], *found[2:]], 2, match_time=3.0)
    problems |= unable(load_match(match), [found[1]], 1, match_time=3.0, patience=5.0)
    words = {contender.label: why.problem for contender, why in problems.items()}
    assert list(words) == ["Mine-1", "Raises", "Dies", "Mine-2"]
    assert words["Mine-1"].count("no_such_module") == 1
    assert "loops.py:Mine: the first 3 s of a game were not over after 5 s" in words["Mine-2"]
    assert "it fails too often: ValueError: no idea (players.py, line 23, in act)" in words["Raises"]
    assert "ended" in words["Dies"]


def test_strategies_with_one_name_get_numbers() -> None:
    labels = [c.label for c in contenders(["a.py:Mine", "b.py:Mine", "other", "my.module:Odd name"])]
    assert labels == ["Mine-1", "Mine-2", "other", "Odd name"]


def test_calls_are_counted_by_rule_and_team() -> None:
    assert counted([("tag", "red"), ("tag", "blue"), ("tag", "red"), ("begin", "")]) == {
        "tag": {"red": 2, "blue": 1},
        "begin": {"": 1},
    }


CODE = f"{OWN}return STILL\n"


@pytest.fixture
def files(match: Path) -> list[Path]:
    """Two files of one name in two folders."""
    found = []
    for folder in ("a", "b"):
        path = match.parent / folder / "player.py"
        path.parent.mkdir()
        path.write_text(CODE, encoding="utf-8")
        found.append(path)
    return found


@pytest.mark.parametrize("changed", [0, 1])
def test_of_two_files_of_one_name_both_count(match: Path, files: list[Path], changed: int) -> None:
    found = contenders([f"{file}:Mine" for file in files])
    before = define(load_match(match), found, seed=0, limit=100.0)
    files[changed].write_text(CODE + "\n# changed\n", encoding="utf-8")
    after = define(load_match(match), found, seed=0, limit=100.0)
    assert [difference.endswith("has changed") for difference in after.differences(before)] == [True]


def test_what_the_match_file_says_of_a_team_is_replaced(match: Path, files: list[Path]) -> None:
    match.write_text(
        match.read_text(encoding="utf-8") + '\n[teams.sharks]\nstrategy = "a/player.py:Mine"\n', encoding="utf-8"
    )
    setup = written(load_match(match), {"sharks": "sharks-and-minnows", "minnows": "sharks-and-minnows"})
    assert "player.py" not in setup.text
    assert setup.text.count('strategy = "sharks-and-minnows"') == len(setup.players) + 1
