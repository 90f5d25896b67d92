"""RoboFlag keeps the contracts of games and of strategies."""

from pathlib import Path

import pytest

from tests.games.roboflag.making import book, field
from vrg.coordinator.rulebook import Observation
from vrg.games import STRATEGIES
from vrg.games.roboflag.player import RoboFlagPlayer
from vrg.games.roboflag.rules import RoboFlag
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.strategy import StrategyContract

NAMES = [name for name in STRATEGIES.names() if issubclass(STRATEGIES.get(name), RoboFlagPlayer)]

MATCH = """
name = "small"
game = "roboflag"
map = "open"
engine = "planar"
seed = 3
lasers = false

[rules]
scale = 2.0
lineup = "place"

[teams.red]
strategy = "{red}"

[teams.blue]
strategy = "{blue}"
"""

PLAYER = """
[[players]]
name = "{name}"
role = "{role}"
x = {x}
y = {y}
heading = {heading}
"""


def match_text(red: str, blue: str) -> str:
    """A match of two against two."""
    places = [("red", -1.5, -1.0, 0.0), ("red", -1.5, 1.0, 0.0), ("blue", 1.5, 1.0, 180.0), ("blue", 1.5, -1.0, 180.0)]
    players = [
        PLAYER.format(name=f"{role}{i % 2 + 1}", role=role, x=x, y=y, heading=heading)
        for i, (role, x, y, heading) in enumerate(places)
    ]
    return MATCH.format(red=red, blue=blue) + "".join(players)


class TestRules(RuleBookContract):
    @pytest.fixture
    def book(self) -> RoboFlag:
        return book()

    @pytest.fixture
    def ready(self, book: RoboFlag) -> Observation:
        return field(book)


def test_all_nine_strategies_are_registered() -> None:
    assert len(NAMES) == 9


@pytest.mark.parametrize("strategy", NAMES)
class TestStrategies(StrategyContract):
    seconds = 8.0

    @pytest.fixture
    def match_file(self, strategy: str, tmp_path: Path) -> Path:
        file = tmp_path / "match.toml"
        file.write_text(match_text(strategy, "balanced"))
        return file
