"""RoboFlag in a batch: the same calls at the same looks as the referee of a match."""

import numpy as np
import pytest
from msgspec import structs

from batch.refereeing import Singles, Spirits, compare, smaller
from vrg.config.loading import load_match, match_path
from vrg.config.rules import rulebook_of
from vrg.games.roboflag import TEAMS
from vrg_learn.batch.observing import OWN

SETUP = load_match(match_path("roboflag"))
SMALL = smaller(
    SETUP, ("red1", "red2", "red3", "blue2", "blue3"), scale=1.7, round_time=25.0, sudden_death=5.0, captures=1
)
LAYOUT = rulebook_of(SMALL).layout
KEEPERS = {f"{team}3": {"x": LAYOUT.flag(team)[0], "y": LAYOUT.flag(team)[1] + 0.3} for team in TEAMS}
SMALL = structs.replace(SMALL, players=[structs.replace(p, **KEEPERS.get(p.name, {})) for p in SMALL.players])
"""One player of each team begins in its flag zone."""
PLACES, SLOTS = OWN + 9, OWN + 9 + 4 * 4
SLOT = 12


def drives(seen: Singles, rng: np.random.Generator) -> Singles:
    """Half of each team go for the flag and home again, the others for the nearest opponent, now and then astray."""
    slots = seen[:, :, SLOTS:].reshape(*seen.shape[:2], -1, SLOT)
    nearest = np.argmax(slots[..., 8] == 0.0, axis=-1)
    slot = np.take_along_axis(slots, nearest[..., None, None], axis=2)[:, :, 0]
    carrying = seen[..., OWN + 2] == 1.0
    flag, home = seen[..., PLACES : PLACES + 2], seen[..., PLACES + 8 : PLACES + 10]
    goal = np.where(carrying[..., None], home, flag)
    bearing = np.arctan2(goal[..., 1], goal[..., 0])
    hunts = (np.arange(seen.shape[1]) % 2 == 1) & ~carrying
    bearing = np.where(hunts, np.arctan2(slot[..., 1], slot[..., 0]), bearing) + rng.normal(0.0, 0.5, bearing.shape)
    astray = rng.random(bearing.shape) < 0.02
    turn = np.clip(np.where(astray, rng.uniform(-3.0, 3.0, bearing.shape), bearing), -1.0, 1.0)
    return np.stack((np.clip(1.2 - np.abs(bearing), 0.1, 1.0), turn), axis=-1).astype(np.float32)


def test_the_calls_of_a_small_match_are_those_of_the_referee(in_python: None) -> None:
    found = compare(SMALL, 1, drives, ended=1, seed=52)
    assert not found.differences
    assert {"tag", "flag", "home", "capture", "time"} <= found.calls.keys()


@pytest.mark.thorough
def test_the_calls_are_those_of_the_referee_wherever_players_are(in_python: None) -> None:
    places = [(LAYOUT.home(team).x, LAYOUT.home(team).y) for team in TEAMS] + [LAYOUT.flag(team) for team in TEAMS]
    found = compare(SMALL, 1, drives, ended=3, seed=3, leaps=Spirits([*places, (LAYOUT.midline, 0.0)]))
    assert not found.differences
    assert min(found.calls[rule] for rule in ("tag", "flag", "home", "capture", "sudden_death")) > 0


@pytest.mark.thorough
def test_the_calls_are_those_of_the_referee() -> None:
    setup = smaller(SETUP, [p.name for p in SETUP.players], round_time=50.0, sudden_death=10.0, captures=2)
    found = compare(setup, 24, drives, ended=24)
    assert not found.differences
    assert found.calls["tag"] > 100
    assert min(found.calls[rule] for rule in ("flag", "home", "capture", "time", "sudden_death")) > 3
