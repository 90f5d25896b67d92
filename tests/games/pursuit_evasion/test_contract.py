"""Pursuit-evasion keeps the contracts of games and of strategies."""

import math
from pathlib import Path

import pytest

from tests.games.pursuit_evasion.making import book, field
from vrg.config.loading import load_match, match_path
from vrg.coordinator.rulebook import Observation
from vrg.errors import ConfigError
from vrg.games.pursuit_evasion.rules import PursuitEvasion
from vrg.testing.rulebook import RuleBookContract
from vrg.testing.strategy import StrategyContract
from vrg.types import Pose


class TestRules(RuleBookContract):
    # No robot drives through another, or leaves its course and is back, between two looks.
    by_looks = frozenset({"collision", "off_course"})

    @pytest.fixture
    def book(self) -> PursuitEvasion:
        return book()

    @pytest.fixture
    def ready(self, book: PursuitEvasion) -> Observation:
        return field(book)


class TestPlayers(StrategyContract):
    seconds = 30.0

    @pytest.fixture
    def match_file(self, tmp_path: Path) -> Path:
        file = tmp_path / "match.toml"
        file.write_text(match_path("pursuit-evasion-table-4-1").read_text().replace('"pybullet"', '"planar"'))
        return file


def test_the_match_of_the_thesis_is_found_by_its_name_and_has_the_poses_of_table_4_1() -> None:
    setup = load_match(match_path("pursuit-evasion-table-4-1"))
    table = [(-7.0, -20.0, 0.0), (3.0, -22.0, 180.0), (-3.0, -26.0, 0.0), (-7.5, -16.0, -60.0), (-1.3, -28.4, 105.0)]
    assert [p.pose for p in setup.players] == [Pose(x, y, pytest.approx(math.radians(a))) for x, y, a in table]
    with pytest.raises(ConfigError, match="expected a match file"):
        match_path("pursuit-evasion-table-4-2")
