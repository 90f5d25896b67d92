"""Pursuit-evasion keeps the contracts of games and of strategies."""

from pathlib import Path

import pytest

from tests.games.pursuit_evasion.making import book, field
from vrg.config.loading import match_path
from vrg.coordinator.rulebook import Field
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.strategy import StrategyContract


class TestRules(RuleBookContract):
    @pytest.fixture
    def book(self) -> PursuitEvasion:
        return book()

    @pytest.fixture
    def ready(self, book: PursuitEvasion) -> Field:
        return field(book)


class TestPlayers(StrategyContract):
    @pytest.fixture
    def match_file(self, tmp_path: Path) -> Path:
        file = tmp_path / "match.toml"
        file.write_text(match_path("pursuit-evasion-table-4-1").read_text().replace('"pybullet"', '"planar"'))
        return file
