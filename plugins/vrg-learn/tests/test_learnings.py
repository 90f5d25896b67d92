"""What is known of games that programs learn: by the name of the game, also of other packages, with little to load."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest
from making import GAMES_LEARNED, Situation

from vrg import registry
from vrg.errors import ConfigError
from vrg.games import GAMES
from vrg_learn.default import default_of
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


def test_a_game_whose_package_says_nothing_is_learned_by_what_its_rule_book_publishes() -> None:
    learning = learning_of("practice")
    assert learning.numbers == ("my role is player", "i may move", "i am out of play", "time left", "round", "lead")
    assert learning.places == ("nearest point of the field", "centre of the field")
    assert learning.flags == ("mate", "player", "may move", "out of play")
    assert learning.states == ("active",)


@pytest.mark.parametrize("game", [name for name in GAMES_LEARNED if name != "pursuit-evasion"])
def test_what_a_rule_book_publishes_is_what_a_player_sees(game: str) -> None:
    situation = Situation(game)
    situation.learning = default_of(GAMES.get(game))
    first, *others = (player.name for player in situation.state.players)
    me = situation.state.player(first)
    assert me is not None
    seen = situation.seen(situation.view(first))
    assert [name for name, value in seen.items() if name.startswith("my role") and value] == [f"my role is {me.role}"]
    assert (seen["i may move"], seen["i am out of play"], seen["time left"], seen["lead"]) == (1.0, 0.0, 1.0, 0.0)
    roles = [role.name for role in GAMES.get(game).roles]
    for role in roles:
        count = sum(seen[f"other {number}: {role}"] for number in range(1, len(others) + 1))
        assert count == sum(player.role == role and player.name != first for player in situation.state.players)
    for zone in situation.state.zones:
        inside = zone.region.contains(situation.poses[first].x, situation.poses[first].y)
        assert (seen[f"nearest point of the {zone.name}: distance"] == 0.0) == inside
    for thing in situation.state.objects:
        assert seen[f"place of the {thing.name}: nearness"] > 0.0


def test_a_game_that_nobody_has_is_answered_with_those_that_can_be_learned_and_the_place() -> None:
    with pytest.raises(ConfigError, match=r"^old\.npz: game that can be learned: expected one of .*roboflag.*'chess'"):
        learning_of("chess", "old.npz")


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
