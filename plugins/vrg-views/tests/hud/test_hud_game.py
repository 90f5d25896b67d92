"""The Player HUD keeps the contracts of games and of strategies."""

from pathlib import Path

import pytest

from vrg.agents.charon import mermaid
from vrg.bus.messages import OfficialAction, Stage
from vrg.config.loading import load_match, match_path
from vrg.coordinator.match import Match
from vrg.coordinator.rulebook import Contestant, GameState, Observation
from vrg.errors import ConfigError
from vrg.games.practice.rules import Settings
from vrg.hal.sensors.camera import CameraSpec
from vrg.hal.sensors.laser import LaserSpec
from vrg.hal.sensors.sonar import SonarSpec
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.strategy import StrategyContract
from vrg.types import Pose
from vrg_views.hud.player import Passenger
from vrg_views.hud.rules import PlayerHud

PLAYERS = [
    Contestant(name=name, role="player", start=Pose(x, 0.0, 0.0), size=(0.5, 0.5), v_max=0.7)
    for name, x in (("a", 0.0), ("b", 3.0))
]
READY = Observation({c.name: c.start for c in PLAYERS})


class TestRules(RuleBookContract):
    @pytest.fixture
    def book(self) -> PlayerHud:
        return PlayerHud(Settings(x=(-5, 5), y=(-5, 5), time=20.0), PLAYERS)

    @pytest.fixture
    def ready(self) -> Observation:
        return READY


class TestPlayer(StrategyContract):
    seconds = 10.0

    @pytest.fixture
    def match_file(self, tmp_path: Path) -> Path:
        return match_path("hud")


def test_it_lasts_until_an_official_ends_it() -> None:
    match = Match(PlayerHud(Settings(), PLAYERS))
    for _ in range(1000):
        match.step(10.0, READY, [])
    assert match.stage is Stage.PLAY_ROUND
    assert all(player.may_move for player in match.state(READY, estop=False).players)


def test_nothing_can_be_overruled() -> None:
    book = PlayerHud(Settings(), PLAYERS)
    with pytest.raises(ConfigError, match="hud has no scores"):
        book.overrule(GameState(), OfficialAction.SET_SCORE, "team", "1")


def test_the_robots_of_its_match_have_what_the_display_shows() -> None:
    setup = load_match(match_path("hud"))
    for player in setup.players:
        assert {LaserSpec, SonarSpec, CameraSpec} <= {type(spec) for spec in player.robot.sensors}


def test_its_automaton_can_be_drawn() -> None:
    drawn = mermaid(Passenger.agent())
    assert "Watch --> Goto: goto" in drawn
    assert "Goto_Drive --> Goto_Turn: goal reached" in drawn
