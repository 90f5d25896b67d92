"""Rewards for calls, for winning and for progress."""

import pytest
from making import GAMES_LEARNED, Situation

from vrg.bus.messages import Call
from vrg.games import GAMES
from vrg.types import Pose
from vrg_learn.games.pursuit_evasion import REWARDS as PURSUIT
from vrg_learn.games.roboflag import REWARDS as FLAGS
from vrg_learn.games.roboflag import SHAPING
from vrg_learn.games.sharks_and_minnows import REWARDS as SHARKS
from vrg_learn.learning import learning_of
from vrg_learn.rewards import for_calls, for_progress, for_winning, standpoint

TEAMS = {"a": "red", "b": "red", "c": "blue", "d": "blue"}


def call(rule: str, *players: str) -> Call:
    return Call(number=1, rule=rule, text="-", players=players, poses=(), clock=0.0)


def test_who_is_tagged_pays_and_each_who_tags_is_paid() -> None:
    assert for_calls([call("tag", "a", "c", "d")], SHARKS, TEAMS) == {"a": -1.0, "b": 0.0, "c": 1.0, "d": 1.0}


def test_every_minnow_that_is_safe_is_paid_when_the_pass_is_over() -> None:
    assert for_calls([call("pass_over", "a", "b", "c")], SHARKS, TEAMS) == {"a": 1.0, "b": 1.0, "c": 1.0, "d": 0.0}
    assert for_calls([call("pass_over")], SHARKS, TEAMS) == dict.fromkeys(TEAMS, 0.0)


def test_a_captured_flag_pays_the_whole_team() -> None:
    assert for_calls([call("capture", "c")], FLAGS, TEAMS) == {"a": -1.0, "b": -1.0, "c": 1.0, "d": 1.0}


def test_a_captured_intruder_pays_the_pursuers_and_one_that_escapes_the_intruders() -> None:
    pursuers = {"a": 1.0, "b": 1.0, "c": -1.0, "d": -1.0}
    for rule in ("capture", "off_course", "slow"):
        named = ("c", "a") if rule == "capture" else ("c",)
        assert for_calls([call(rule, *named)], PURSUIT, TEAMS) == pursuers
    assert for_calls([call("escape", "c")], PURSUIT, TEAMS) == {name: -reward for name, reward in pursuers.items()}


def test_calls_add_up_and_others_count_for_nothing() -> None:
    calls = [call("tag", "a", "c"), call("flag", "b"), call("home", "a"), call("halt"), call("tag", "c", "a")]
    assert for_calls(calls, SHAPING, TEAMS) == pytest.approx({"a": 0.0, "b": 0.2, "c": 0.0, "d": 0.0})


def test_winning_is_paid_to_the_team_and_a_draw_to_nobody() -> None:
    assert for_winning("red", TEAMS) == {"a": 1.0, "b": 1.0, "c": -1.0, "d": -1.0}
    for nobody in ("draw", "nobody", None):
        assert set(for_winning(nobody, TEAMS).values()) == {0.0}


@pytest.mark.parametrize("game", GAMES_LEARNED)
def test_every_rule_that_is_paid_for_is_one_of_the_game(game: str) -> None:
    learning = learning_of(game)
    assert not {*learning.rewards, *learning.shaping} - set(GAMES.get(game).rule_texts)


def test_coming_nearer_to_the_safe_zone_is_progress() -> None:
    far, near = (
        standpoint(game.view("player2"), game.learning)
        for game in (Situation("sharks-and-minnows", {"player2": Pose(20.0, y, 0.0)}) for y in (-20.0, -21.0))
    )
    reach = (10.0**2 + 19.0**2) ** 0.5
    assert far.potential == pytest.approx(-8.0 / reach)
    assert for_progress(far, near, 1.0) == pytest.approx(1.0 / reach)
    assert for_progress(far, far, 0.9) == pytest.approx(0.1 * 8.0 / reach)


def test_a_shark_makes_progress_to_the_nearest_active_minnow() -> None:
    poses = {"player1": Pose(21.0, -25.0, 0.0), "player2": Pose(21.0, -24.0, 0.0), "player3": Pose(21.0, -22.0, 0.0)}
    states = dict.fromkeys([f"player{n}" for n in range(1, 8)], "active")
    game = Situation("sharks-and-minnows", poses, states=states)
    without = Situation("sharks-and-minnows", poses, states={**states, "player2": "inactive"})
    reach = (10.0**2 + 19.0**2) ** 0.5
    assert standpoint(game.view("player1"), game.learning).potential == pytest.approx(-1.0 / reach)
    assert standpoint(without.view("player1"), without.learning).potential == pytest.approx(-3.0 / reach)
    assert standpoint(without.view("player2"), without.learning).potential is None


def test_a_player_that_has_become_another_has_made_no_progress() -> None:
    poses = {"red1": Pose(1.0, 0.0, 0.0)}
    normal = Situation("roboflag", poses)
    states = dict.fromkeys(normal.poses, "normal")
    flagged = Situation("roboflag", poses, states={**states, "red1": "flagged"})
    tagged = Situation("roboflag", poses, states={**states, "red1": "tagged"})
    second = Situation("roboflag", poses, round=2)
    at = [standpoint(game.view("red1"), game.learning) for game in (normal, flagged, tagged, second)]
    assert [for_progress(at[0], other, 1.0) for other in at] == [0.0, 0.0, 0.0, 0.0]
    assert at[1].potential == pytest.approx(-((7.0**2 + 4.0**2) ** 0.5) / (12.0**2 + 8.0**2) ** 0.5)
    assert at[2].potential is None
