"""What somebody else has written is found by its name, and passes the suites that VRG ships for it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vrg.config.loading import load_match
from vrg.coordinator.rulebook import Contestant, Observation, RuleBook
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg.hal.backends import BACKENDS
from vrg.hal.driver import DriverContext
from vrg.hal.models import MODELS
from vrg.launch.nodes.referee import open_journal
from vrg.launch.strategy_class import strategy_of
from vrg.playing.in_process import play
from vrg.runs.result import conclusion, write_result
from vrg.runs.run_folder import RunFolder
from vrg.testing.driver import DriverBench, DriverContract
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.strategy import StrategyContract
from vrg.types import Pose


class TestRace(RuleBookContract):
    CONTESTANTS = (
        Contestant(name="amber", role="red", start=Pose(-4.0, 1.5, 0.0), size=(0.5, 0.49), v_max=0.7),
        Contestant(name="jade", role="green", start=Pose(-4.0, -1.5, 0.0), size=(0.5, 0.49), v_max=0.7),
    )

    @pytest.fixture
    def book(self) -> RuleBook[Any]:
        game = GAMES.get("race")
        rules: Callable[..., RuleBook[Any]] = game.load_rules()
        return rules(game.load_settings()(x=4.0, y=0.0), self.CONTESTANTS, 0)

    @pytest.fixture
    def ready(self) -> Observation:
        return Observation({c.name: c.start for c in self.CONTESTANTS})


class TestRacer(StrategyContract):
    @pytest.fixture
    def match_file(self) -> Path:
        return GAMES.get("race").default_match()


class HoverBench(DriverBench):
    """The robot glides in the time of this bench."""

    def __init__(self) -> None:
        self.now = 100.0
        make: Callable[[DriverContext], Any] = BACKENDS.get("hover")
        self.driver = make(DriverContext(name="r", model=MODELS.get("P2AT"), now=lambda: self.now))

    def advance(self, seconds: float) -> None:
        self.now += seconds

    def cut(self) -> None:
        self.driver.read()
        self.driver.cut = True  # type: ignore[attr-defined]


class TestHover(DriverContract):
    @pytest.fixture
    def bench(self) -> HoverBench:
        return HoverBench()


def test_its_match_names_a_map_a_model_an_engine_and_strategies_of_the_package() -> None:
    setup = load_match(GAMES.get("race").default_match())
    assert (setup.game, setup.map, setup.world.engine) == ("race", "island", "ideal")
    assert {strategy_of(setup, player.name).__module__.split(".")[0] for player in setup.players} == {"toys"}
    assert {player.model for player in setup.players} == {"Scout"}


def test_a_mistake_in_the_rules_of_the_game_is_found_with_its_line(tmp_path: Path) -> None:
    text = GAMES.get("race").default_match().read_text(encoding="utf-8")
    file = tmp_path / "match.toml"
    file.write_text(text.replace("x = 4.0", "x = -4.0").replace("y = 0.0\n", "y = 1.5\n"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"match.toml:10: .*amber: starts in the finish"):
        load_match(file)


def test_its_reason_for_the_end_of_the_game_is_told_whole(installed: None, tmp_path: Path) -> None:
    setup, folder = load_match(GAMES.get("race").default_match()), RunFolder(tmp_path)
    with open_journal(setup, folder) as journal:
        ending = play(setup, journal)
    result = write_result(setup, folder, ending.state, "game over")
    assert conclusion(result).endswith(": one lap: first home, first served")
