"""A planner of another package drives all players of a match around what is in their way."""

from pathlib import Path

import pytest

from vrg.bus.messages import Stage
from vrg.config.loading import load_match
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.launch.nodes.referee import open_journal
from vrg.playing.in_process import Ending, play
from vrg.runs.run_folder import RunFolder

MAP = """
name = "barred"
bounds = { shape = "circle", x = 0.0, y = 0.0, radius = 12.0 }
[[box]]
x = 0.0
y = 0.3
length = 0.6
width = 2.0
"""


def race(folder: Path, planner: str) -> Ending:
    """The race of the package with a bar between its start and its finish."""
    (folder / "barred.toml").write_text(MAP)
    text = GAMES.get("race").default_match().read_text().replace('"island"', '"barred.toml"')
    file = folder / "match.toml"
    file.write_text(f"{planner}\n{text.replace('ideal', 'planar')}")
    setup = load_match(file)
    run = RunFolder(folder / "run")
    run.prepare()
    with open_journal(setup, run) as journal:
        return play(setup, journal, limit=60.0)


def test_players_that_would_drive_against_a_bar_come_past_it(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    assert race(tmp_path / "a", "").state.stage is not Stage.GAME_OVER
    assert race(tmp_path / "b", 'planner = "around"').state.stage is Stage.GAME_OVER


def test_a_planner_that_is_not_installed_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"planner: expected one of around, got 'round', did you mean 'around'"):
        race(tmp_path, 'planner = "round"')
