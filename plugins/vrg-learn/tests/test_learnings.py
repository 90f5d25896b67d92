"""What is known of games that programs learn: by the name of the game, also of other packages, with little to load."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest
from making import GAMES_LEARNED

from vrg import registry
from vrg.errors import ConfigError
from vrg_learn.games.roboflag import LEARNING
from vrg_learn.learning import LEARNINGS, learning_of


def test_the_games_of_vrg_can_be_learned() -> None:
    assert set(GAMES_LEARNED) <= set(LEARNINGS.names())
    assert learning_of("roboflag") is LEARNING


def test_a_package_outside_adds_a_game_that_can_be_learned(monkeypatch: pytest.MonkeyPatch) -> None:
    group = LEARNINGS.group
    made = {
        "race": EntryPoint("race", "vrg_learn.games.roboflag:LEARNING", group),
        "walk": EntryPoint("walk", "math:pi", group),
    }
    monkeypatch.setattr(registry, "added", lambda: {group: made})
    assert learning_of("race") is LEARNING
    with pytest.raises(ConfigError, match=r"walk: expected a vrg_learn\.learning\.Learning, got 3\.14"):
        learning_of("walk")


def test_a_game_that_nobody_can_learn_is_answered_with_those_that_can_be_and_the_place() -> None:
    with pytest.raises(
        ConfigError, match=r"^old\.npz: game that can be learned: expected one of .*roboflag.*'practice'"
    ):
        learning_of("practice", "old.npz")


@pytest.mark.parametrize(
    ("modules", "unwanted"),
    [
        ("learning, vrg_learn.games.roboflag, vrg_learn.games.sharks_and_minnows, vrg_learn.games.pursuit_evasion",
         ("numpy", "gymnasium", "pettingzoo")),
        ("observation, vrg_learn.rewards, vrg_learn.state, vrg_learn.episode", ("gymnasium", "pettingzoo", "pygame")),
    ],
    ids=["what a game has of its own", "a strategy that has learned"],
)  # fmt: skip
def test_nothing_is_loaded_that_is_not_needed(modules: str, unwanted: tuple[str, ...]) -> None:
    code = f"import sys\nimport vrg_learn.{modules}\nprint(*(m for m in {unwanted} if m in sys.modules))"
    out = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert out.stdout.split() == []
