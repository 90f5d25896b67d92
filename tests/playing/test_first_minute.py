"""The default match of each game shows within a minute what the game is about, and is never dull for long."""

from pathlib import Path
from statistics import median

import pytest

from vrg.config.loading import load_match, match_path
from vrg.testing import matches
from vrg.testing.audience import ABOUT, SOON, MatchWatcher, Seen


def seen(game: str, engine: str, seed: int, folder: Path, limit: float = 900.0) -> Seen:
    setup = load_match(match_path(game), engine=engine, seed=seed)
    audience = MatchWatcher(setup)
    matches.played(setup, folder, audience, limit=limit)
    return audience.seen


def shows(game: str, found: Seen) -> bool:
    return found.first(ABOUT[game]) <= SOON and found.still < 15.0 and found.waited < 3.0


@pytest.mark.parametrize("game", ABOUT)
def test_the_seed_that_the_match_has(game: str, tmp_path: Path) -> None:
    assert shows(game, seen(game, "planar", 0, tmp_path, limit=SOON))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("engine", "seeds"), [("planar", 100), ("pybullet", 20), ("mujoco", 20)], ids=["planar", "pybullet", "mujoco"]
)
@pytest.mark.parametrize("game", ABOUT)
def test_many_seeds(game: str, engine: str, seeds: int, tmp_path: Path) -> None:
    found = [seen(game, engine, seed, tmp_path / str(seed)) for seed in range(seeds)]
    assert sum(shows(game, one) for one in found) >= 0.9 * seeds
    assert 60.0 <= median(one.length for one in found) <= 180.0
    winners = [one.winner for one in found]
    if engine == "planar":
        assert all(0.3 <= winners.count(team) / seeds <= 0.7 for team in set(winners) - {"draw"})
