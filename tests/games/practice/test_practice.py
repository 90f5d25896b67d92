"""Practice keeps the contracts of games and of strategies, and `vrg practice` makes a match of it."""

import json
import tomllib
from pathlib import Path

import pytest
from pydantic import ValidationError

from vrg.bus.messages import Stage
from vrg.commands.practice import match_text
from vrg.config.loading import load_match
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import NOBODY, Contestant, Observation
from vrg.errors import ConfigError
from vrg.games.practice.rules import Practice, Settings
from vrg.testing.command_line import invoke
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.strategy import StrategyContract
from vrg.types import Pose

PLAYERS = [
    Contestant(name=name, role="player", start=Pose(x, 0.0, 0.0), size=(0.5, 0.5), v_max=0.7)
    for name, x in (("a", 0.0), ("b", 3.0))
]
READY = Observation({c.name: c.start for c in PLAYERS})


class TestRules(RuleBookContract):
    @pytest.fixture
    def book(self) -> Practice:
        return Practice(Settings(x=(-5, 5), y=(-5, 5), time=20.0), PLAYERS)

    @pytest.fixture
    def ready(self) -> Observation:
        return READY


class TestPlayer(StrategyContract):
    seconds = 10.0

    @pytest.fixture
    def match_file(self, tmp_path: Path) -> Path:
        file = tmp_path / "match.toml"
        file.write_text(match_text("open", 2, "P2AT", None, 5.0, None) + "\n")
        return file


def test_everybody_may_move_at_once_and_until_the_time_is_up() -> None:
    match = Match(Practice(Settings(time=1.0), PLAYERS))
    match.step(0.1, READY, [])
    assert match.stage is Stage.PLAY_ROUND
    assert all(player.may_move for player in match.state(READY, estop=False).players)
    for _ in range(50):
        match.step(0.1, READY, [])
    assert (match.stage, match.winner) == (Stage.GAME_OVER, NOBODY)


def test_without_a_time_it_lasts() -> None:
    match = Match(Practice(Settings(), PLAYERS))
    for _ in range(1000):
        match.step(10.0, READY, [])
    assert match.stage is Stage.PLAY_ROUND
    assert match.state(READY, estop=False).zones == ()


@pytest.mark.parametrize("wrong", [{"x": (0, 1)}, {"x": (1, 0), "y": (0, 1)}, {"time": -1.0}])
def test_settings_that_make_no_sense_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Settings.model_validate(wrong)


@pytest.mark.parametrize(("map_", "robots"), [("courtyard", 1), ("courtyard", 12), ("open", 32), ("marhes_lab", 3)])
def test_robots_are_put_where_there_is_room(tmp_path: Path, map_: str, robots: int) -> None:
    file = tmp_path / "practice.toml"
    file.write_text(match_text(map_, robots, "P2AT", None, 0.0, None))
    assert len(load_match(file).players) == robots


def test_the_first_one_begins_where_it_is_asked_to() -> None:
    table = tomllib.loads(match_text("courtyard", 2, "P2AT", "mine.py:Mine", 3.0, (20.0, -20.0, 450.0)))
    first = table["players"][0]
    assert (first["x"], first["y"], first["heading"]) == (20.0, -20.0, 90.0)
    assert {p["strategy"] for p in table["players"]} == {"mine.py:Mine"}


def test_no_room_is_told() -> None:
    with pytest.raises(ConfigError, match="expected a place on map 'courtyard' that is free of walls"):
        match_text("courtyard", 1, "P2AT", None, 0.0, (-12.0, -22.0, 0.0))
    with pytest.raises(ConfigError, match="--robots: map 'marhes_lab' has room for"):
        match_text("marhes_lab", 500, "P2AT", None, 0.0, None)


def test_a_strategy_is_tried(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from vrg.agents import Strategy, Twist\n\n\nclass Mine(Strategy):\n"
        "    def act(self, view):\n        return Twist(v=0.5, w=0.0)\n"
    )
    command = ["practice", f"{tmp_path}/mine.py:Mine", "--in-process", "--engine", "planar", "--for", "3"]
    done = invoke(*command, "--no-record", "--runs", str(tmp_path / "runs"))
    assert done.exit_code == 0, done.output
    assert "Over (" in done.output
    result = json.loads(next((tmp_path / "runs").glob("*/result.json")).read_text())
    assert (result["game"], result["ended"]) == ("practice", "game over")


def test_a_practice_whose_only_player_fails_has_failed(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from vrg.agents import Strategy\n\n\nclass Mine(Strategy):\n    def act(self, view):\n        return 1 / 0\n"
    )
    command = ["practice", f"{tmp_path}/mine.py:Mine", "--in-process", "--engine", "planar", "--for", "3"]
    done = invoke(*command, "--no-record", "--runs", str(tmp_path / "runs"))
    assert done.exit_code == 1, done.output
    assert "Everybody is disqualified (" in done.output
