"""The rules of RoboFlag about time and the end: rounds, captures, sudden death, and what a halt does not change."""

import pytest
from msgspec import structs

from tests.games.roboflag.making import AWAY, DT, FLAGS, HOMES, Play, book, field, starts
from vrg.bus.messages import Stage
from vrg.coordinator.rulebook import DRAW, Observation
from vrg.games.roboflag import FLAGGED, NORMAL, TAGGED
from vrg.games.roboflag.rules import RoboFlag

QUIET, NEAR = (2.0, 0.0), (2.3, 0.0)


def short(round_time: float = 5.0, sudden_death: float = 3.0, **settings: object) -> RoboFlag:
    """The rule book of a match with short rounds."""
    return book(round_time=round_time, sudden_death=sudden_death, **settings)


@pytest.fixture
def play() -> Play:
    """A match with short rounds."""
    return Play(short())


def test_there_are_two_rounds_of_ten_minutes_and_a_sudden_death_of_five() -> None:
    rules = book()
    assert rules.rounds == 2
    assert rules.settings.round_time == 600.0
    assert rules.settings.sudden_death == 300.0
    assert rules.settings.captures == 3


@pytest.mark.parametrize("dt", [0.1, 0.05, 0.25, 1 / 3])
def test_a_round_of_ten_minutes_ends_with_the_first_tick_at_ten_minutes(dt: float) -> None:
    play = Play(book())
    ticks = 0
    while play.match.stage is Stage.PLAY_ROUND:
        play.tick(dt=dt)
        ticks += 1
    assert ticks == round(600 / dt)
    assert play.calls[-1] == ("time",)


def test_what_happens_in_the_last_tick_still_counts(play: Play) -> None:
    play.ticks(4.8)
    play.tick({"red1": FLAGS["blue"]})
    play.tick({"red1": HOMES["red"]})
    assert play.calls[-2:] == [("capture", "red1"), ("time",)]


def test_scores_carry_over_but_positions_and_flags_do_not(play: Play) -> None:
    play.capture("red1")
    play.tick({"red1": FLAGS["blue"], "red2": QUIET, "blue2": NEAR})
    assert play.state.states["red2"] == TAGGED
    play.ticks(4.7, {"red1": AWAY["red"]})
    assert play.match.stage is Stage.ROUND_OVER
    assert play.state.flag("blue").carrier == "red1"
    play.pause()
    assert play.match.game.round == 2
    assert play.state.points == {"red": 1, "blue": 0}
    assert set(play.state.states.values()) == {NORMAL}
    assert [thing.carrier for thing in play.state.objects] == [None, None]
    assert play.state.driven == {}
    assert play.match.clock == 0.0


def test_players_line_up_at_their_starts_before_each_round(play: Play) -> None:
    play.ticks(5.0)
    while play.match.stage is Stage.ROUND_OVER:
        play.tick(dt=1.0)
    assert play.match.stage is Stage.INITIALIZE
    assert {name: play.match.mark(name, field(play.rules)) for name in play.match.names} == starts()
    play.tick({"red1": QUIET})
    assert play.match.stage is Stage.INITIALIZE, "one of them is not at its start"
    assert play.match.waiting == ["red1 is 5.7 m from its mark"] or "red1" in play.match.waiting[0]
    play.tick()
    assert play.match.stage is Stage.PLAY_ROUND


def test_the_starts_of_a_team_are_shared_so_that_ways_do_not_cross() -> None:
    rules, begun = short(), starts()
    ended = {"red1": (begun["red2"].x, begun["red2"].y), "red2": (begun["red1"].x, begun["red1"].y)}
    marks = rules.next_round(rules.initial(), field(rules, ended)).state.marks
    assert marks == begun | {"red1": begun["red2"], "red2": begun["red1"]}


def test_a_round_waits_for_players_that_still_move() -> None:
    rules = book()
    now = Observation(field(rules).poses, frozenset({"blue3"}))
    assert set(rules.obstacles_to_start(rules.initial(), now)) == {"blue3"}


def both_capture(play: Play) -> None:
    """Both teams bring a flag home in the same tick."""
    play.tick({"red1": FLAGS["blue"], "blue1": FLAGS["red"]})
    play.tick({"red1": HOMES["red"], "blue1": HOMES["blue"]})


def test_the_third_capture_of_both_teams_in_one_tick_is_a_tie_and_goes_to_sudden_death(play: Play) -> None:
    for _ in range(3):
        both_capture(play)
    assert play.match.stage is Stage.ROUND_OVER
    play.pause()
    assert not play.match.over
    assert play.match.game.round == 3
    play.capture("blue2")
    play.pause()
    assert play.match.winner == "blue"


def suddenly(**settings: object) -> Play:
    """A match whose two rounds have ended in a tie."""
    play = Play(short(**settings))
    for _ in range(2):
        play.ticks(5.0)
        play.pause()
    assert play.match.stage is Stage.PLAY_ROUND
    return play


def test_in_sudden_death_a_capture_of_both_in_one_tick_is_a_draw() -> None:
    play = suddenly()
    both_capture(play)
    assert play.match.stage is Stage.ROUND_OVER
    play.pause()
    assert (play.match.over, play.match.winner) == (True, DRAW)


# The clock stops in HALT.


def test_in_a_halt_nobody_is_driven_and_nobody_may_move() -> None:
    play = Play(book())
    play.tick({"red1": QUIET, "blue1": NEAR})
    assert set(play.match.driven) == {"red1"}
    play.match.halt("somebody is on the field")
    assert play.match.driven == {}
    told = play.match.state(field(play.rules), estop=False)
    assert not any(player.may_move for player in told.players)
    play.match.resume()
    assert set(play.match.driven) == {"red1"}, "it is still tagged"


# What everybody is told.


def test_everybody_is_told_states_flags_scores_and_the_tag_distance() -> None:
    play = Play(book())
    play.capture("red1")
    play.tick({"red1": FLAGS["blue"], "red2": QUIET, "blue1": NEAR})
    told = play.match.state(field(play.rules), estop=False)
    assert told.score == {"red": 1, "blue": 0}
    assert {p.name: p.state for p in told.players if p.state != NORMAL} == {"red1": FLAGGED, "red2": TAGGED}
    assert {thing.name: thing.carrier for thing in told.objects} == {"red flag": None, "blue flag": "red1"}
    assert told.numbers == {"tag distance": 0.6, "time limit": 600.0}
    assert (told.round, told.rounds) == (1, 2)


def test_a_match_that_goes_on_after_a_crash_is_as_it_was() -> None:
    play = Play(book())
    play.capture("red1")
    play.tick({"red1": FLAGS["blue"], "red2": QUIET, "blue1": NEAR})
    again = type(play.match)(play.rules, play.match.standing())
    assert again.halted
    again.resume()
    assert again.game == play.state
    assert again.driven == play.match.driven


# Disqualifications through the match.


def test_a_tagged_player_that_fails_is_driven_no_longer() -> None:
    play = Play(book())
    play.tick({"red1": QUIET, "blue1": NEAR})
    play.match.disqualify("red1", "it has failed", field(play.rules))
    assert play.match.driven == {}
    play.tick({"red1": HOMES["red"]})
    told = play.match.state(field(play.rules), estop=False)
    assert next(p for p in told.players if p.name == "red1").state == "disqualified"


def test_a_player_that_was_disqualified_plays_again_from_the_next_round(play: Play) -> None:
    play.match.disqualify("red1", "it has failed", field(play.rules))
    play.match.reinstate("red1", field(play.rules))
    play.tick({"red1": FLAGS["blue"]})
    assert play.state.flag("blue").carrier is None, "not in this round"
    play.ticks(4.9)
    play.pause()
    play.tick({"red1": FLAGS["blue"]})
    assert play.state.flag("blue").carrier == "red1"


def test_no_round_waits_for_a_disqualified_player(play: Play) -> None:
    play.match.disqualify("red1", "it has failed", field(play.rules))
    play.ticks(5.0)
    while play.match.stage is Stage.ROUND_OVER:
        play.tick(dt=1.0)
    play.tick({"red1": QUIET})
    assert play.match.stage is Stage.PLAY_ROUND


def test_a_match_whose_players_are_all_disqualified_is_a_draw() -> None:
    play = Play(book(red=1, blue=1))
    for name in ("red1", "blue1"):
        play.match.disqualify(name, "it has failed", field(play.rules))
    play.tick()
    assert (play.match.over, play.match.winner) == (True, DRAW)


@pytest.mark.parametrize(
    ("points", "number", "why"),
    [
        ({"red": 3, "blue": 1}, 1, "3 flags are captured"),
        ({"red": 1, "blue": 2}, 2, "the time is up"),
        ({"red": 2, "blue": 1}, 3, "the lead in sudden death, 2 to 1"),
        ({"red": 3, "blue": 4}, 3, "the lead in sudden death, 4 to 3"),
        ({"red": 1, "blue": 1}, 3, "still a tie after sudden death, 1 to 1"),
    ],
)
def test_the_call_at_the_end_tells_why_the_game_is_over(points: dict[str, int], number: int, why: str) -> None:
    rules = short()
    state = structs.replace(rules.initial(), points=points, round=number)
    assert rules.next_round(state, field(rules)).why == why


def test_why_the_game_is_over_is_announced(play: Play) -> None:
    match = play.match
    play.capture("blue1")
    play.ticks(5.0 - 2 * DT)
    play.pause()
    play.ticks(5.0)
    texts: list[str] = []
    while not match.over:
        texts += [call.text for call in match.step(0.1, field(play.rules), []).calls]
    assert texts[-1] == "game over: blue wins: the time is up"
