"""Sharks and Minnows in a batch: the same calls at the same looks as the referee of a match."""

import numpy as np
import pytest

from batch.refereeing import Singles, Spirits, compare, smaller
from vrg.config.loading import load_match, match_path
from vrg_learn.batch.observing import OWN

SETUP = load_match(match_path("sharks-and-minnows-table-4-2"))
SMALL = smaller(SETUP, [f"player{n}" for n in range(1, 7)], y=[-32.0, -14.4], pass_limit=25.0)
FEW = smaller(
    SETUP, ["player1", "player3", "player4", "player6"], x=[18.5, 23.5], y=[-32.0, -14.4], passes=1, pass_limit=9.0
)
"""A shark and three minnows, which soon leave the field."""
OTHERS, SLOT = OWN + 8 + 2 * 4, 12
"""Where the slots of other players begin in an observation, and their length."""


def drives(seen: Singles, rng: np.random.Generator) -> Singles:
    """Minnows drive to the safe zone, sharks to the nearest minnow, and all of them astray now and then."""
    slots = seen[:, :, OTHERS:].reshape(*seen.shape[:2], -1, SLOT)
    prey = (slots[..., 8] == 0.0) & (slots[..., 10] == 1.0)
    nearest = np.argmax(prey, axis=-1)
    slot = np.take_along_axis(slots, nearest[..., None, None], axis=2)[:, :, 0]
    shark = seen[..., OWN] == 1.0
    goal = seen[..., OWN + 8 : OWN + 10]
    bearing = np.where(shark, np.arctan2(slot[..., 1], slot[..., 0]), np.arctan2(goal[..., 1], goal[..., 0]))
    bearing = bearing + rng.normal(0.0, 0.6, bearing.shape)
    astray = rng.random(bearing.shape) < 0.02
    turn = np.clip(np.where(astray, rng.uniform(-3.0, 3.0, bearing.shape), bearing), -1.0, 1.0)
    return np.stack((np.clip(1.2 - np.abs(bearing), 0.1, 1.0), turn), axis=-1).astype(np.float32)


def test_the_calls_of_a_small_match_are_those_of_the_referee(in_python: None) -> None:
    found = compare(SMALL, 1, drives, ended=1, seed=26)
    assert not found.differences
    assert {"tag", "pass_limit", "pass_over", "new_shark"} <= found.calls.keys()


def aside(seen: Singles, rng: np.random.Generator) -> Singles:
    """Players drive out of the field to its sides by turns, but for every third one, which stands."""
    number = np.arange(seen.shape[1])
    bearing = np.where(number % 2 == 1, 0.0, np.pi) - np.arctan2(seen[..., 1], seen[..., 0])
    turn = np.clip(np.arctan2(np.sin(bearing), np.cos(bearing)), -1.0, 1.0)
    stands = np.broadcast_to(number % 3 == 2, turn.shape)
    return np.stack((np.where(stands, 0.0, 1.0 - np.abs(turn)), np.where(stands, 0.0, turn)), axis=-1).astype(
        np.float32
    )


def test_the_calls_are_those_of_the_referee_where_a_shark_and_a_minnow_leave_the_field(in_python: None) -> None:
    found = compare(FEW, 1, aside, ended=1)
    assert not found.differences
    assert found.calls["out_of_bounds"] == 2


@pytest.mark.thorough
def test_the_calls_are_those_of_the_referee_wherever_players_are(in_python: None) -> None:
    places = [(21.0, -31.0), (21.0, -15.4), (12.0, -31.0), (21.0, -12.4)]
    found = compare(SMALL, 1, drives, ended=1, seed=11, leaps=Spirits(places, near=2.0))
    assert not found.differences
    assert min(found.calls[rule] for rule in ("tag", "out_of_bounds", "pass_over", "new_shark")) > 0


@pytest.mark.thorough
def test_the_calls_are_those_of_the_referee() -> None:
    found = compare(SETUP, 32, drives, ended=60)
    assert not found.differences
    assert found.calls["tag"] > 100
    assert min(found.calls[rule] for rule in ("out_of_bounds", "pass_over", "new_shark")) > 20
