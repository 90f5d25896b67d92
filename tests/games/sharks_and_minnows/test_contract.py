"""Sharks and Minnows keeps the contracts of games and of strategies."""

from pathlib import Path

import pytest

from tests.games.sharks_and_minnows.test_rules import SETTINGS, contestants
from vrg.config.loading import match_path
from vrg.coordinator.rulebook import Observation
from vrg.games.sharks_and_minnows.rules import SharksAndMinnows
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.strategy import StrategyContract


class TestRules(RuleBookContract):
    @pytest.fixture
    def book(self) -> SharksAndMinnows:
        return SharksAndMinnows(SETTINGS, contestants())

    @pytest.fixture
    def ready(self) -> Observation:
        return Observation({c.name: c.start for c in contestants()})


class TestPlayer(StrategyContract):
    seconds = 30.0

    @pytest.fixture
    def match_file(self, tmp_path: Path) -> Path:
        file = tmp_path / "match.toml"
        text = match_path("sharks-and-minnows").read_text()
        file.write_text(text.replace("[rules]", 'engine = "planar"\nlasers = false\n[rules]'))
        return file
