"""What officials may decide in RoboFlag."""

import pytest

from tests.games.roboflag.making import FLAGS, HOMES, Play, book, calls, carrying, judge, tagged
from vrg.bus.messages import Official, OfficialAction, Stage
from vrg.coordinator.decisions import decide
from vrg.coordinator.rulebook import Observation
from vrg.errors import ConfigError
from vrg.games.roboflag import FLAGGED, NORMAL, TAGGED
from vrg.games.roboflag.rules import RoboFlag

SCORE, STATE, ROLE = OfficialAction.SET_SCORE, OfficialAction.SET_STATE, OfficialAction.SET_ROLE


@pytest.fixture
def rules() -> RoboFlag:
    """The rule book of four against four."""
    return book()


@pytest.fixture
def play() -> Play:
    """A match that has begun."""
    return Play(book())


def test_an_official_sets_the_score_of_a_team(rules: RoboFlag) -> None:
    state = rules.overrule(rules.initial(), SCORE, "blue", "2")
    assert rules.score(state) == {"red": 0, "blue": 2}


def test_a_score_that_is_set_to_three_ends_the_game(play: Play) -> None:
    play.match.overrule(SCORE, "blue", "3")
    play.tick()
    assert play.match.stage is Stage.ROUND_OVER
    play.pause()
    assert play.match.winner == "blue"


def test_a_capture_that_an_official_takes_back_counts_no_longer(play: Play) -> None:
    for _ in range(2):
        play.capture("red1")
    play.match.overrule(SCORE, "red", "1")
    play.capture("red1")
    assert play.match.stage is Stage.PLAY_ROUND
    assert play.state.points["red"] == 2


def test_a_third_capture_that_is_taken_back_in_the_pause_does_not_end_the_game(play: Play) -> None:
    for _ in range(3):
        play.capture("red1")
    assert play.match.stage is Stage.ROUND_OVER
    play.match.overrule(SCORE, "red", "2")
    while play.match.stage is Stage.ROUND_OVER:
        play.tick(dt=1.0)
    assert not play.match.over, "nobody has captured three flags, and there is a second round"


def test_a_score_that_ends_the_tie_ends_sudden_death() -> None:
    play = Play(book(round_time=1.0))
    for _ in range(2):
        play.ticks(1.0)
        play.pause()
    assert play.state.round == 3
    play.tick()
    assert play.match.stage is Stage.PLAY_ROUND
    play.match.overrule(SCORE, "blue", "1")
    play.tick()
    play.pause()
    assert play.match.winner == "blue"


def test_an_official_lets_a_tagged_player_play_on_and_it_is_driven_no_longer(rules: RoboFlag) -> None:
    state = rules.overrule(rules.initial(), STATE, "red1", TAGGED)
    assert state.states["red1"] == TAGGED
    assert set(state.driven) == {"red1"}
    state = rules.overrule(state, STATE, "red1", NORMAL)
    assert (state.states["red1"], state.driven) == (NORMAL, {})


def test_a_tagged_player_is_driven_to_a_place_at_home_from_which_it_can_turn_inside_the_field(rules: RoboFlag) -> None:
    led_to = rules.overrule(rules.initial(), STATE, "red1", TAGGED).driven["red1"].outline()
    home = rules.layout.home("red").shrunk(-1e-9)
    assert all(home.contains(*place) and rules.layout.field.depth(*place) > 0.25 for place in led_to)


def test_an_official_gives_a_player_the_flag(rules: RoboFlag) -> None:
    state = rules.overrule(rules.initial(), STATE, "red1", FLAGGED)
    assert state.flag("blue").carrier == "red1"
    assert calls(judge(rules, {"red1": HOMES["red"]}, state)) == [("capture", "red1")]


@pytest.mark.parametrize("to", [NORMAL, TAGGED])
def test_the_flag_returns_if_an_official_takes_its_carrier_away(rules: RoboFlag, to: str) -> None:
    state = rules.overrule(carrying(rules, "red1"), STATE, "red1", to)
    assert state.flag("blue").carrier is None
    assert state.states["red1"] == to
    assert calls(judge(rules, {"red2": FLAGS["blue"]}, state)) == [("flag", "red2")]


def test_a_tagged_player_that_is_given_the_flag_is_driven_no_longer(rules: RoboFlag) -> None:
    state = rules.overrule(tagged(rules, "red1"), STATE, "red1", FLAGGED)
    assert state.driven == {}


def test_to_name_a_player_flagged_that_is_so_already_changes_nothing(rules: RoboFlag) -> None:
    state = carrying(rules, "red1")
    assert rules.overrule(state, STATE, "red1", FLAGGED) == state


def test_a_flag_that_has_a_carrier_is_not_given_to_another_player(rules: RoboFlag) -> None:
    with pytest.raises(ConfigError, match="red1 has the flag of blue already"):
        rules.overrule(carrying(rules, "red1"), STATE, "red2", FLAGGED)


@pytest.mark.parametrize(
    ("action", "subject", "value", "told"),
    [
        (SCORE, "green", "1", "expected one of blue, red"),
        (SCORE, "red1", "1", "expected one of blue, red"),
        (SCORE, "red", "-1", "whole number"),
        (SCORE, "red", "one", "whole number"),
        (STATE, "red9", NORMAL, "expected one of"),
        (STATE, "red", NORMAL, "expected one of"),
        (STATE, "red1", "asleep", "expected one of flagged, normal, tagged"),
        (ROLE, "red1", "blue", "cannot be set in this game"),
        (ROLE, "red9", "blue", "expected one of"),
    ],
)
def test_what_makes_no_sense_is_refused_in_words(action: OfficialAction, subject: str, value: str, told: str) -> None:
    rules = book()
    with pytest.raises(ConfigError, match=told):
        rules.overrule(rules.initial(), action, subject, value)


def test_an_official_disqualifies_a_carrier_and_the_flag_returns(play: Play) -> None:
    play.tick({"red1": FLAGS["blue"]})
    decision = Official(action=OfficialAction.DISQUALIFY, by="Ann", subject="red1", value="pushing")
    decide(play.match, decision, Observation({}), [])
    assert play.match.disqualified["red1"].by_official
    play.tick({"red1": HOMES["red"]})
    assert play.calls[-1] == ("flag_returns", "red1")
    assert play.state.points == {"red": 0, "blue": 0}


def test_the_game_goes_on_when_a_whole_team_is_disqualified_and_the_other_can_still_score() -> None:
    play = Play(book(red=1, blue=1))
    play.match.disqualify("blue1", "it has failed", Observation({}))
    play.capture("red1")
    assert play.state.points == {"red": 1, "blue": 0}
    assert play.match.stage is Stage.PLAY_ROUND
